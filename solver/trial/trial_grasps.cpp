// SPDX-License-Identifier: MIT
#include "solver/trial/trial_grasps.h"

#include <mutex>

#include "geometry/parallel.h"
#include "solver/hand/hand_postures.h"

namespace holdfast {

std::vector<HoldTrial> TryGrasps(const HandModel& hand, const TriangleMesh& object,
                                 std::span<const CertifiedGrasp> grasps,
                                 const TrialProtocol& protocol,
                                 const std::function<bool(double)>& progress) {
  RequirePhysics();
  const SignedDistance distance(object);
  const TrialSolid solid = MakeTrialSolid(object, distance, protocol);
  const HandEvaluation at_wrist = AtWrist(hand);
  TrialProtocol of_each = protocol;
  of_each.threads = 1;
  const auto count = static_cast<int>(grasps.size());
  std::vector<HoldTrial> trials(grasps.size());
  std::mutex mutex;
  int done = 0;
  bool stopped = false;
  ParallelFor(count, protocol.threads, [&](int i) {
    {
      const std::lock_guard lock(mutex);
      if (stopped) return;
    }
    const Grasp& grasp = grasps[static_cast<std::size_t>(i)].grasp;
    HandEvaluation evaluation = at_wrist;
    trials[static_cast<std::size_t>(i)] =
        TryHold(evaluation.At(grasp.fingers.data(), false), grasp.wrist_from_object, solid,
                distance, of_each);
    const std::lock_guard lock(mutex);
    ++done;
    stopped = stopped || (progress && !progress(static_cast<double>(done) / count));
  });
  return trials;
}

}  // namespace holdfast
