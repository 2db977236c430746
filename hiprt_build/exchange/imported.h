#pragma once
/// Builds the binary tree of an imported tree. Internal.

#include <hiprt_build/exchange.h>
#include <hiprt_build/exchange/exchange_check.h>
#include <hiprt_build/exec/cpu.h>
#include <hiprt_build/tree/binary_tree.h>

namespace hiprt::build {

/// Builds a binary tree with one reference per leaf; the primitives of one may have several. The result does not depend
/// on the number of threads.
/// @param checked what check_tree() says of @p tree.
/// @param references one per leaf, whose primitives have the same home.
DepthFirstTree build_imported(CpuEngine& engine, const ExchangeBvh& tree, const CheckedTree& checked,
                              const GeometryTable& geometries, ScratchArray<Reference> references);

}  // namespace hiprt::build
