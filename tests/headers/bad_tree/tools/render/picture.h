#pragma once
#include <tools/cli/options.h>  // expect
#include <tools/scene_io/mesh.h>
