// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

#include <Eigen/Core>

#include "geometry/clip/clip.h"
#include "geometry/import/import_file.h"
#include "geometry/io/container/npz.h"
#include "geometry/rotation.h"
#include "tests/support/error_text.h"

namespace holdfast::testing {

inline std::filesystem::path Fixture(const std::string& name) {
  return std::filesystem::path(HOLDFAST_SOURCE_DIR) / "tests/fixtures" / name;
}

/// Of make_hand_sets.py: a column for each frame.
inline Eigen::MatrixXd ExpectedOfSet(const std::string& name) {
  const NpyMember member = NpzReader(Fixture("hand_sets/expected.npz")).Read(name);
  const std::vector<double> values = member.AsDoubles();
  const auto rows = static_cast<Eigen::Index>(member.array.shape.back());
  return Eigen::Map<const Eigen::MatrixXd>(values.data(), rows,
                                           static_cast<Eigen::Index>(values.size()) / rows);
}

/// Imports a file of tests/fixtures, its world and its frame rate left as they are.
inline ImportedFile Import(const std::filesystem::path& path, ImportFileOptions options = {}) {
  static const std::shared_ptr<const BodyModel> body = BodyModel::Default();
  options.parameters.keep_ground = true;
  options.parameters.body = body;
  return ImportFile(path, options);
}

inline std::string ImportFault(const std::filesystem::path& path,
                               const ImportFileOptions& options = {}) {
  return ErrorText([&] { Import(path, options); });
}

/// Largest difference of the entries of two matrices.
template <typename A, typename B>
double MaxDifference(const A& a, const B& b) {
  return (a - b).cwiseAbs().maxCoeff();
}

/// What the codes that write these files would make of them (make_parameters.py): numbers of one
/// frame or vertex a column.
inline Eigen::MatrixXd Expected(const std::string& name) {
  const NpzReader archive(Fixture("parameters/expected.npz"));
  const NpyMember member = archive.Read(name);
  const std::vector<double> values = member.AsDoubles();
  const Eigen::Index rows = member.array.shape.empty() ? 1 : member.array.shape.back();
  return Eigen::Map<const Eigen::MatrixXd>(values.data(), rows,
                                           static_cast<Eigen::Index>(values.size()) / rows);
}

/// Joints [begin, begin + count) of every frame, (3 count x T).
inline Eigen::MatrixXd Joints(const Clip& clip, int begin, int count) {
  Eigen::MatrixXd joints(3 * count, clip.NumFrames());
  for (int t = 0; t < clip.NumFrames(); ++t) {
    joints.col(t) = clip.pose[t].middleCols(begin, count).reshaped();
  }
  return joints;
}

/// Vertices under a track, all frames behind each other: R v + T.
inline Eigen::MatrixXd Posed(const Eigen::MatrixXd& vertices, const ObjectTrack& track) {
  Eigen::MatrixXd posed(3, vertices.cols() * track.trans.cols());
  for (Eigen::Index t = 0; t < track.trans.cols(); ++t) {
    posed.middleCols(t * vertices.cols(), vertices.cols()) =
        (ExpSO3(track.orient.col(t)) * vertices).colwise() + track.trans.col(t);
  }
  return posed;
}

/// Largest difference of two matrices of rotations (axis-angle, 3J x T) as rotations, radians.
inline double LargestTurn(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  double largest = 0;
  for (Eigen::Index t = 0; t < a.cols(); ++t) {
    for (Eigen::Index j = 0; j + 2 < a.rows(); j += 3) {
      const Eigen::Vector3d v = a.col(t).segment(j, 3), w = b.col(t).segment(j, 3);
      largest = std::max(largest, AngleBetween(ExpSO3(v), ExpSO3(w)));
    }
  }
  return largest;
}

inline bool Mentions(const std::vector<std::string>& texts, const std::string& part) {
  for (const std::string& text : texts) {
    if (text.find(part) != std::string::npos) return true;
  }
  return false;
}

}  // namespace holdfast::testing
