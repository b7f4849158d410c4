// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "geometry/body/body_model.h"
#include "geometry/body/own_body.h"
#include "geometry/clip/clip.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

class BallTree;

/// Number of object surface points tested against the body, in addition to all vertices; spread
/// evenly by area (SampleSurface).
inline constexpr int kOwnBodySamples = 2000;

/// Penetration depth into the person's own body per frame.
struct BodyDepth {
  std::vector<double> depth_mm;  ///< T, of the deepest point; 0 if none is inside
  double max_mm = 0.0, mean_mm = 0.0;
  int worst_frame = 0;  ///< the first with the largest depth

  /// Fraction of frames deeper than this.
  double DeepRatio(double deep_mm) const;
};

/// Penetration of the object and the arms into the person's own body, and into the clip's table,
/// over a clip.
struct OwnBodyScore {
  /// The object's vertices and kOwnBodySamples points of its surface, in trunk, neck, head, legs
  /// and any arm that never holds it. None without an object.
  std::optional<BodyDepth> object;
  /// Skin of both forearms and hands (OwnBody::ForearmAndHand) in trunk, neck, head and legs.
  BodyDepth arms;
  /// The same points of object and arms in the clip's table. None without a table with a mesh.
  std::optional<BodyDepth> object_in_table, arms_in_table;
  int object_points = 0;
};

/// Measures a person and an object, for any of their clips. Const and shareable between threads.
class OwnBodyMeter {
 public:
  /// `body` has all vertices, must outlive this object and is not a hand alone; `object` may be
  /// null. `holders`: arms that hold the object in some frame (bits as in Clip::holding_hand).
  OwnBodyMeter(const BodySurface& body, const TriangleMesh* object, std::uint8_t holders);

  /// Measures every frame. Frames are distributed over `threads`; the result does not depend on it.
  /// `progress` (frames done, frames) may be empty, is never called concurrently, and stops the
  /// measurement by returning false.
  OwnBodyScore Measure(const Clip& clip, int threads = 1,
                       const std::function<bool(int, int)>& progress = {}) const;

 private:
  const BodySurface& body_;
  std::vector<int> arms_;  // vertices
  OwnBody for_arms_, for_object_;
  std::shared_ptr<const BallTree> points_;  // of the object, if present
};

/// Applies OwnBodyMeter to one clip; returns nothing for a hand-only model.
std::optional<OwnBodyScore> MeasureOwnBody(const Clip& clip, const BodySurface& body,
                                           const TriangleMesh* object, std::uint8_t holders,
                                           int threads = 1,
                                           const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
