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

/// Solves frame by frame, each from the previous one, to initialize a joint solve near the markers.
/// `start` has the first frame's pose.
MarkerTrack FollowMarkers(const MarkedPerson& person, const MarkerCalibration& calibration,
                          const std::vector<SeenMarkers>& frames, MarkerTrack start);

/// Solves all frames at once: markers, rest, limits, and accelerations that couple frames
/// (PoseAcceleration) and thus interpolate gaps. Starts from `start`; roots are free if the pelvis
/// is marked. `frame_rate` in Hz. If `progress` stops the solve, the result is not converged.
MarkerTrack TrackMarkers(const MarkedPerson& person, const MarkerCalibration& calibration,
                         const std::vector<SeenMarkers>& frames, double frame_rate,
                         MarkerTrack start, int max_iterations,
                         const std::function<bool(int, int)>& progress);

/// Positions of all markers predicted by the body (3 M x T), world, meters.
Eigen::MatrixXd CarriedMarkers(const MarkedPerson& person, const MarkerCalibration& calibration,
                               const MarkerTrack& track);

/// Labeling errors, detected from the predicted marker positions.
struct MarkerFaults {
  struct Swap {
    int frame, a, b;
  };
  struct Outlier {
    int frame, marker;
    double off_m;
  };
  std::vector<Swap> swaps;        ///< labels of markers a and b are exchanged
  std::vector<Outlier> outliers;  ///< far from the predicted position: not used
};
/// Finds and corrects errors in `frames`: swaps labels back and removes outliers.
MarkerFaults RepairMarkers(const Eigen::MatrixXd& carried, std::vector<SeenMarkers>& frames);

}  // namespace holdfast
