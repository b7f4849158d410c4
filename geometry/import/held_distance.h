// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>

#include "geometry/clip/clip_body.h"
#include "geometry/mesh/mesh.h"

namespace holdfast {

/// How far a hand is from the object in the frames in which the clip says that it holds it.
struct HeldDistance {
  int frames = 0;          ///< with a hand that holds
  double median_mm = 0.0;  ///< over (at most 40 of) them, of the nearest vertex; 0 inside
};

/// Nothing for a clip without labels or object. `object` is in its own frame.
std::optional<HeldDistance> MeasureHeldDistance(const Clip& clip, const ClipBody& body,
                                                const TriangleMesh& object);

/// Of hands that are said to hold and are more than a centimetre away: another body than the clip's
/// has other limbs.
struct HeldWarning {
  std::string seen, advice;
};
std::optional<HeldWarning> WarnOfHeldDistance(const Clip& clip, const ClipBody& body,
                                              const TriangleMesh& object);

/// What becomes of a clip as it was imported on `model`, without changing it: a note where it was
/// made with another kind of model (else empty), and the warning above where its object is there.
struct BodyNotes {
  std::string change;
  std::optional<HeldWarning> held;
};
BodyNotes NotesOnBody(const Clip& clip, const std::shared_ptr<const BodyModel>& model,
                      const TriangleMesh* object);

}  // namespace holdfast
