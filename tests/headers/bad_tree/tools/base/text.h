#pragma once
#include <tools/cli/options.h>  // expect
