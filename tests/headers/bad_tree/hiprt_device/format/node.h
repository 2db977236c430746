#pragma once
// A tree that breaks each rule of include_arrows.py once; every forbidden line says so.
#include <hip/hip_runtime.h>        // expect
#include <hiprt_build/build.h>      // expect
#include <hiprt_device/math/vec.h>  // expect
#include <hiprt_device/ray.h>       // expect
#include <tools/cli/options.h>      // expect

#include <cstdint>  // expect
/* #include <hiprt_device/ray.h> in a comment is none */
// #include <hiprt_device/ray.h> neither
