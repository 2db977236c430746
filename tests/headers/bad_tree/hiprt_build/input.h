#pragma once
#include <hiprt_build/build.h>  // expect
