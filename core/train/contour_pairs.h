#pragma once

#include <span>
#include <vector>

#include "core/contour_pair.h"
#include "core/geometry/view_sphere.h"
#include "core/run_control.h"

namespace binpose {

/// A contour point of the part with the viewpoints that show it.
struct PooledContour {
  ContourPoint point;
  ViewMask views;
};

/// Merges the contour points of all views that show the same piece of contour; outward directions are turned into the
/// tangent plane. Pieces that fewer than 2 % of the views show are dropped, as are the sides of rounded surfaces, where
/// each view has a contour of its own.
///
/// @param cell  points nearer than this, with normal and outward direction within about 25 degrees, are one piece;
/// metres.
/// Ends early when `control` interrupts.
std::vector<PooledContour> pool_contours(std::span<const std::vector<ContourPoint>> views, double cell,
                                         const RunControl& control = {});

/// The `count` contour pairs with the most expected true votes over the noise of false ones, Obs / sqrt(Ph), best
/// first, with the weight of a vote of each.
struct RatedContourPairs {
  std::vector<ContourPair> pairs;
  std::vector<float> weights;
};
RatedContourPairs select_contour_pairs(std::span<const PooledContour> contours, double diameter, std::size_t count,
                                       int view_count, const RunControl& control);

}  // namespace binpose
