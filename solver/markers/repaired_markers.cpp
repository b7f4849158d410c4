// SPDX-License-Identifier: MIT
#include "solver/markers/repaired_markers.h"

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

namespace holdfast {
namespace {

// Fills gaps of `used` with `carried` plus the interpolated deviation at the adjacent frames.
Eigen::Matrix3Xd Filled(const Eigen::Matrix3Xd& used, const Eigen::Matrix3Xd& carried) {
  Eigen::Matrix3Xd filled = used;
  std::optional<Eigen::Index> before;
  for (Eigen::Index t = 0; t < used.cols();) {
    if (!used.col(t).hasNaN()) {
      before = t++;
      continue;
    }
    Eigen::Index after = t;
    while (after < used.cols() && used.col(after).hasNaN()) ++after;
    const auto off = [&](Eigen::Index at) -> Eigen::Vector3d {
      return used.col(at) - carried.col(at);
    };
    const bool ends = after == used.cols();
    const Eigen::Vector3d first = before ? off(*before)
                                  : ends ? Eigen::Vector3d(Eigen::Vector3d::Zero())
                                         : off(after);
    const Eigen::Vector3d last = ends ? first : off(after);
    const Eigen::Index begin = before.value_or(-1);
    for (; t < after; ++t) {
      const double s = static_cast<double>(t - begin) / static_cast<double>(after - begin);
      filled.col(t) = carried.col(t) + (1.0 - s) * first + s * last;
    }
  }
  return filled;
}

Eigen::Matrix3Xd PathOf(const Eigen::MatrixXd& positions, int marker) {
  return positions.middleRows(3 * marker, 3);
}

void RepairBody(const SolvedRecording& solved, MarkerRecording& recording) {
  for (std::size_t k = 0; k < solved.report.markers.size(); ++k) {
    const std::optional<int> column = recording.Find(solved.report.markers[k].site.name);
    if (!column) continue;  // only in the static trial
    const auto marker = static_cast<int>(k);
    recording.positions.middleRows(3 * *column, 3) =
        Filled(PathOf(solved.used, marker), PathOf(solved.carried, marker));
  }
}

void RepairObject(const SolvedRecording& solved, MarkerRecording& recording) {
  if (!solved.report.object || !solved.clip.object) return;
  const ObjectMarkerReport& report = *solved.report.object;
  const ObjectTrack& track = *solved.clip.object;
  const MarkerWorld& world = solved.report.world;
  const Eigen::Vector3d lift(0.0, 0.0, solved.report.lift_m);
  std::vector<int> columns;
  for (const auto& marker : report.markers) columns.push_back(*recording.Find(marker.name));
  for (const auto& swap : report.faults.swaps) {
    recording.positions.block<3, 1>(3 * columns[swap.a], swap.frame)
        .swap(recording.positions.block<3, 1>(3 * columns[swap.b], swap.frame));
  }
  for (const auto& outlier : report.faults.outliers) {
    recording.positions.block<3, 1>(3 * columns[outlier.marker], outlier.frame)
        .setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  for (std::size_t k = 0; k < columns.size(); ++k) {
    Eigen::Matrix3Xd carried(3, recording.NumFrames());
    for (Eigen::Index t = 0; t < carried.cols(); ++t) {
      const Eigen::Vector3d at = track.Pose(t) * report.markers[k].place;
      carried.col(t) = world.world_from_recording.transpose() * (at - lift) / world.scale;
    }
    recording.positions.middleRows(3 * columns[k], 3) =
        Filled(PathOf(recording.positions, columns[k]), carried);
  }
}

}  // namespace

MarkerRecording RepairedMarkers(const MarkerRecording& recording, const SolvedRecording& solved) {
  MarkerRecording repaired = recording;
  RepairBody(solved, repaired);
  RepairObject(solved, repaired);
  repaired.positions *= solved.report.world.scale;
  return repaired;
}

}  // namespace holdfast
