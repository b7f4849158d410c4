// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <limits>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "geometry/mesh/distance_grid.h"
#include "geometry/parallel.h"
#include "solver/grasp/finger_closing.h"
#include "solver/grasp/grasp_assessment.h"
#include "solver/grasp/grasp_handle_placement.h"
#include "solver/terms/hand/penetration.h"

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

  /// A closed hand, and whether its thumb touches.
  std::pair<GraspAttempt, bool> Close(const Placement& placement, HandEvaluation& evaluation) const;

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

struct RefinementOptions {
  double contact_reach_m = 0.008;  ///< pads nearer than this are attracted to the surface
  int rounds = 2;                  ///< the active points are updated in each
  int iterations = 15;             ///< of Levenberg-Marquardt, per round
};

/// Parts of the object inside a hand with these vertices (3 x n, wrist frame).
using FindIntrusions =
    std::function<std::vector<Intrusion>(const Eigen::Matrix3Xd&, const Eigen::Isometry3d&)>;

/// Refines a closed hand and its object by least squares: pads on the surface, no penetration,
/// angles within their limits and near the given ones. All 45 finger parameters and the object pose
/// are optimized jointly. `angles` and `wrist_from_object` are the initial values and the result.
/// What `find_intrusions` finds at the start of a round is pushed out as well.
void RefineGrasp(const HandAnatomy& anatomy, HandEvaluation& hand, const DistanceGrid& object,
                 const RefinementOptions& options, HandAngles& angles,
                 Eigen::Isometry3d& wrist_from_object, const FindIntrusions& find_intrusions = {});

}  // namespace holdfast
