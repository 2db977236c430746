#pragma once
/// FLIP: the visible difference between two pictures when a viewer flips between them.

#include <tools/base/parallel.h>
#include <tools/render/image/color_image.h>

namespace hiprt::tools {

/// Computes LDR-FLIP of every pixel: 0 (equal) to 1 (green beside blue; black beside white is 0.967). Source:
/// Andersson, Nilsson, Akenine-Moeller, Oskarsson, Astrom and Fairchild, "FLIP: A Difference Evaluator for Alternating
/// Images", HPG 2020. Colours are blurred as the eye does at kPixelsPerDegree (flip_filters.h). They are compared by
/// HyAB with Hunt's effect. Where edges or points differ, the difference is raised. Border pixels are repeated outside
/// the picture.
/// @param picture, reference as they are displayed: linear light, 0 to 1; of one size.
/// @return the values row by row; the same on any number of threads. Empty: interrupted() became true.
/// @throws std::bad_alloc
std::vector<float> flip_map(const ColorImage& picture, const ColorImage& reference, const ThreadLimit& limit);

}  // namespace hiprt::tools
