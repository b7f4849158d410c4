// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include "solver/markers/marker_calibration.h"

namespace holdfast {

/// Poses of all frames of a recording.
struct MarkerTrack {
  Eigen::MatrixXd roots;  ///< (6 x T)
  Eigen::MatrixXd poses;  ///< (n x T), q of FreePose
  int iterations = 0;
  bool converged = false;
};

/// Frame after frame, each from the one before, so that a solve of all begins near the markers:
/// `start` has the first frame's pose.
MarkerTrack FollowMarkers(const MarkedPerson& person, const MarkerCalibration& calibration,
                          const std::vector<SeenMarkers>& frames, MarkerTrack start,
                          const MarkerScales& scales);

/// All frames at once: markers, rest, limits, and accelerations that couple them
/// (PoseAcceleration), so that gaps are passed as the body moved. From `start`; roots move where
/// the pelvis is marked. `frame_rate` in Hz. `progress` may stop it: then not converged.
MarkerTrack TrackMarkers(const MarkedPerson& person, const MarkerCalibration& calibration,
                         const std::vector<SeenMarkers>& frames, double frame_rate,
                         MarkerTrack start, const MarkerScales& scales, int max_iterations,
                         const std::function<bool(int, int)>& progress);

/// Where the body carries every marker (3 M x T), world, meters.
Eigen::MatrixXd CarriedMarkers(const MarkedPerson& person, const MarkerCalibration& calibration,
                               const MarkerTrack& track);

/// Labels that went wrong, told by where the body carries the markers.
struct MarkerFaults {
  struct Swap {
    int frame, a, b;
  };
  struct Outlier {
    int frame, marker;
    double off_m;
  };
  std::vector<Swap> swaps;        ///< markers a and b stand for each other
  std::vector<Outlier> outliers;  ///< far from where they can be: not used
};
/// Finds them and puts `frames` right: swapped labels are changed back, outliers taken out.
MarkerFaults RepairMarkers(const Eigen::MatrixXd& carried, std::vector<SeenMarkers>& frames);

}  // namespace holdfast
