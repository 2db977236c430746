#pragma once
#include <tools/base/text.h>
#include <tools/cli/options.h>     // expect
#include <tools/render/picture.h>  // expect
