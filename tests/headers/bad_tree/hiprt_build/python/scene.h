#pragma once
#include <hiprt_build/build.h>
#include <nanobind/nanobind.h>
#include <tools/base/text.h>  // expect
