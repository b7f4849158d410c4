// SPDX-License-Identifier: MIT
#include "solver/take/take_fit.h"

#include "generator/scripted/minimum_jerk.h"
#include "geometry/rotation.h"
#include "solver/fit/clip_state.h"

namespace holdfast {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Clip FitTaken(const TakeMotion& motion, const HandModel& hand, const FitObject& object,
              const FitOptions& options, std::vector<FrameReport>* frames,
              const std::function<bool(int, int)>& progress) {
  constexpr double kRate = 30.0;
  constexpr double kSettle_s = 0.3;
  const int take = motion.times.take, count = motion.clip.NumFrames();
  const Clip held = Slice(motion.clip, take, count);
  const HandModel* hands[] = {&hand};
  const std::vector<std::uint8_t> holding(held.pose.size(), HoldingBit(hand.HandSide()));
  FitResult fitted = FitClip(held, hands, object, holding, options, {}, progress);
  Clip clip = motion.clip;
  // The fit may place the object a little otherwise where the wrist's limits kept the hand off the
  // grasp: it settles into that from where it stands.
  const Matrix3d stands = ExpSO3(held.object->orient.col(0));
  const Vector3d settle = held.object->trans.col(0) - fitted.clip.object->trans.col(0);
  const Vector3d turn = LogSO3(stands * ExpSO3(fitted.clip.object->orient.col(0)).transpose());
  for (int t = 0; t < fitted.clip.NumFrames(); ++t) {
    clip.pose[take + t] = fitted.clip.pose[t];
    clip.trans.col(take + t) = fitted.clip.trans.col(t);
    const double left = 1.0 - MinimumJerk(t / (kSettle_s * kRate));
    const Eigen::Isometry3d pose = fitted.clip.object->Pose(t);
    clip.object->SetPose(take + t, RigidTransform(ExpSO3(left * turn) * pose.linear(),
                                                  pose.translation() + left * settle));
  }
  if (frames != nullptr) *frames = std::move(fitted.frames);
  return clip;
}

}  // namespace holdfast
