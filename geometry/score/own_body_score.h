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

/// Points of an object's surface that are looked for in the body, besides all its vertices: spread
/// evenly by area (SampleSurface).
inline constexpr int kOwnBodySamples = 2000;

/// How deep something is in the person's own body, frame by frame.
struct BodyDepth {
  std::vector<double> depth_mm;  ///< T, of the deepest point; 0 where none is inside
  double max_mm = 0.0, mean_mm = 0.0;
  int worst_frame = 0;  ///< the first with the greatest depth

  /// Share of frames deeper than this.
  double DeepRatio(double deep_mm) const;
};

/// The object and the arms in the person's own body over a clip.
struct OwnBodyScore {
  /// The object's vertices and kOwnBodySamples points of its surface in trunk, neck, head, legs
  /// and any arm that holds it in no frame. Nothing without an object.
  std::optional<BodyDepth> object;
  /// Skin of both forearms and hands (OwnBody::ForearmAndHand) in trunk, neck, head and legs.
  BodyDepth arms;
  int object_points = 0;
};

/// What measures a person and an object, for any of their clips. Const and shared by threads.
class OwnBodyMeter {
 public:
  /// `body` has all vertices, must outlive this and is no hand alone; `object` may be null.
  /// `holders`: arms that hold the object in some frame (bits as in Clip::holding_hand).
  OwnBodyMeter(const BodySurface& body, const TriangleMesh* object, std::uint8_t holders);

  /// Measures every frame. Frames are shared among `threads`; the result does not depend on them.
  /// `progress` (frames done, frames) may be empty, is called one at a time, and stops the
  /// measurement by returning false.
  OwnBodyScore Measure(const Clip& clip, int threads = 1,
                       const std::function<bool(int, int)>& progress = {}) const;

 private:
  const BodySurface& body_;
  std::vector<int> arms_;  // vertices
  OwnBody for_arms_, for_object_;
  std::shared_ptr<const BallTree> points_;  // of the object, if there is one
};

/// OwnBodyMeter for one clip; nothing for a hand alone.
std::optional<OwnBodyScore> MeasureOwnBody(const Clip& clip, const BodySurface& body,
                                           const TriangleMesh* object, std::uint8_t holders,
                                           int threads = 1,
                                           const std::function<bool(int, int)>& progress = {});

}  // namespace holdfast
