// SPDX-License-Identifier: MIT
#include "geometry/import/held_distance.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>

#include "geometry/body/hand_model.h"
#include "geometry/clip/body_change.h"
#include "geometry/mesh/signed_distance.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr std::size_t kSamples = 40;
constexpr double kAwayMm = 10.0;

}  // namespace

std::optional<HeldDistance> MeasureHeldDistance(const Clip& clip, const ClipBody& body,
                                                const TriangleMesh& object) {
  if (!clip.object || object.NumFaces() == 0) return std::nullopt;
  const std::vector<std::uint8_t>& holding = clip.holding_hand;
  std::vector<int> held;
  for (std::size_t t = 0; t < holding.size(); ++t) {
    if (holding[t] != 0) held.push_back(static_cast<int>(t));
  }
  if (held.empty()) return std::nullopt;
  HeldDistance result;
  result.frames = static_cast<int>(held.size());
  const SignedDistance surface(object);
  std::vector<double> nearest(std::min(kSamples, held.size()),
                              std::numeric_limits<double>::infinity());
  for (const Side side : {Side::kRight, Side::kLeft}) {
    if (!body.model->HasHand(side)) continue;
    const HandModel hand(body.model, body.betas, side);
    HandState state(hand);
    for (std::size_t k = 0; k < nearest.size(); ++k) {
      const int t = held[k * held.size() / nearest.size()];
      const auto frame = static_cast<std::size_t>(t);
      if ((holding[frame] & (side == Side::kRight ? kHoldsRight : kHoldsLeft)) == 0) continue;
      state.SetBody(clip.pose[frame], clip.trans.col(t));
      state.Evaluate(FingersOf(clip.pose[frame], side), false);
      const Eigen::Matrix3d rotation = ExpSO3(clip.object->orient.col(t));
      const Eigen::Matrix3Xd in_object =
          rotation.transpose() * (state.Vertices().colwise() - clip.object->trans.col(t));
      nearest[k] = std::min(nearest[k], std::max(0.0, surface.Distances(in_object).minCoeff()));
    }
  }
  const auto middle = nearest.begin() + static_cast<std::ptrdiff_t>(nearest.size() / 2);
  std::ranges::nth_element(nearest, middle);
  result.median_mm = 1e3 * *middle;
  return std::isfinite(result.median_mm) ? std::optional(result) : std::nullopt;
}

std::optional<HeldWarning> WarnOfHeldDistance(const Clip& clip, const ClipBody& body,
                                              const TriangleMesh& object) {
  const std::optional<HeldDistance> held = MeasureHeldDistance(clip, body, object);
  if (!held || held->median_mm <= kAwayMm) return std::nullopt;
  return HeldWarning{
      fmt::format("the clip says that a hand holds the object in {} of {} frames, but the hand of "
                  "{} is {:.0f} mm from it (median)",
                  held->frames, clip.NumFrames(), body.model->Name(), held->median_mm),
      "give the body model that the clip was made with (--body MODEL.npz), or make a new grasp "
      "('holdfast fit CLIP OBJECT --regrasp')"};
}

BodyNotes NotesOnBody(const Clip& clip, const std::shared_ptr<const BodyModel>& model,
                      const TriangleMesh* object) {
  BodyNotes notes;
  if (IsHandAlone(clip) != model->LoneHand().has_value()) return notes;
  Clip moved = clip;
  std::vector<std::string> ignored;
  const ClipBody body = BodyOfClip("", moved, model, ignored);
  const std::optional<BodyChange> change = BringOntoBody(moved, body);
  if (change) notes.change = Describe(*change, *body.model);
  if (object != nullptr) notes.held = WarnOfHeldDistance(moved, body, *object);
  return notes;
}

}  // namespace holdfast
