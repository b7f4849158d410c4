// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <mutex>
#include <optional>
#include <vector>

#include "geometry/parallel.h"
#include "solver/grasp/grasp_assessment.h"
#include "solver/grasp/grasp_handle_placement.h"

namespace holdfast {

/// Common base of the search for one grasp (CloseHand) and for many (FindGrasps): a hand, an
/// object, and the stages from candidate places to assessed hands. All members but RunStage and
/// FindPlaces are const and shared by threads; each thread passes its own HandEvaluation (AtWrist).
class GraspStages {
 public:
  /// All arguments must outlive this.
  GraspStages(const HandModel& hand, const TriangleMesh& object, const DistanceGrid& distance,
              const GraspOptions& options, const GraspProgress& progress);

 protected:
  /// Runs work(i) for 0 <= i < count. Each call writes only slot i, so the order does not matter.
  /// Returns false if the search is to stop.
  template <typename Work>
  bool RunStage(double share_before, double share, int count, const Work& work);

  /// Finds places for a hand by the options' style, use and place. Sets `oppositions_` (at most
  /// `count`) and `allowed_depth_`; with `handles`, also the scene's handles and use.
  void FindPlaces(int samples, int count, std::uint64_t seed, bool handles);
  /// Open hands at a place. Indices cover the antipodal pairs first, then the scene's handles.
  std::vector<Placement> PlaceAt(int place) const;

  struct ClosedHand {
    GraspAttempt attempt;
    bool thumb_touches;
  };
  ClosedHand Close(const Placement& placement, HandEvaluation& evaluation) const;

  std::vector<GraspContact> Contacts(HandEvaluation& evaluation, const FingerPose& fingers,
                                     const Eigen::Isometry3d& wrist_from_object) const;
  /// HoldsGravity and CertifyContacts with the options' friction.
  bool Holds(const std::vector<GraspContact>& contacts) const;
  /// Whether the contacts hold the object firmly: with a squeeze of at most six times its weight,
  /// and twelve where the mass center is off by a tenth of the object's size, in any direction.
  bool HoldsFirmly(const std::vector<GraspContact>& contacts) const;
  GraspCertificate Certify(const std::vector<GraspContact>& contacts) const;

  const HandModel& hand_;
  const TriangleMesh& object_;
  const DistanceGrid& distance_;
  const GraspOptions& options_;
  const GraspProgress& progress_;
  const HandAnatomy anatomy_;
  const GraspPlacer placer_;
  GraspScene scene_;
  const HandEvaluation at_wrist_;  // copied by each evaluating thread
  std::vector<Opposition> oppositions_;
  double allowed_depth_ = 0.0;  // of a hand in the object before it closes, meters
  bool stopped_ = false;

 private:
  std::optional<HandlePlacer> handle_placer_;
  std::mutex mutex_;
};

template <typename Work>
bool GraspStages::RunStage(double share_before, double share, int count, const Work& work) {
  int done = 0;
  ParallelFor(count, options_.threads, [&](int i) {
    {
      const std::lock_guard lock(mutex_);
      if (stopped_) return;
    }
    work(i);
    if (!progress_) return;
    const std::lock_guard lock(mutex_);
    stopped_ = stopped_ || !progress_(share_before + share * ++done / count);
  });
  return !stopped_;
}

}  // namespace holdfast
