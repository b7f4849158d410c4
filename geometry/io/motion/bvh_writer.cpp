// SPDX-License-Identifier: MIT
#include "geometry/io/motion/bvh_writer.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>
#include <vector>

#include <fmt/format.h>

#include "geometry/body/end_site.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

constexpr double kUnitsPerMetre = 100;
constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kDegreesPerRadian = 180 / std::numbers::pi;

using Text = std::back_insert_iterator<std::string>;

// (z, x, y) with R = Rz(z) Rx(x) Ry(y); of the many, the ones nearest to `previous`.
Eigen::Vector3d EulerZxy(const Eigen::Matrix3d& R, const Eigen::Vector3d& previous) {
  const double sine = std::clamp(R(2, 1), -1.0, 1.0);
  const double cosine = std::hypot(R(0, 1), R(1, 1));
  Eigen::Vector3d angles;
  angles[1] = std::atan2(sine, cosine);
  if (cosine > 1e-9) {
    angles[0] = std::atan2(-R(0, 1), R(1, 1));
    angles[2] = std::atan2(-R(2, 0), R(2, 2));
  } else {
    // Straight up or down only z + y or z - y counts: y stays, z takes the rest.
    angles[2] = previous[2];
    const double sum = std::atan2(R(1, 0), R(0, 0));
    angles[0] = sine > 0 ? sum - angles[2] : sum + angles[2];
  }
  const auto nearest = [&](Eigen::Vector3d candidate) {
    for (int c = 0; c < 3; ++c) {
      candidate[c] += kTurn * std::round((previous[c] - candidate[c]) / kTurn);
    }
    return candidate;
  };
  constexpr double kPi = std::numbers::pi;
  const Eigen::Vector3d one = nearest(angles);
  const Eigen::Vector3d other = nearest({angles[0] + kPi, kPi - angles[1], angles[2] + kPi});
  return (one - previous).squaredNorm() <= (other - previous).squaredNorm() ? one : other;
}

void WriteOffset(const Eigen::Vector3d& offset_m, const std::string& indent, Text out) {
  const Eigen::Vector3d offset = kUnitsPerMetre * offset_m;
  fmt::format_to(out, "{}OFFSET {:.6f} {:.6f} {:.6f}\n", indent, offset.x(), offset.y(),
                 offset.z());
}

// Joints in the order of the file, depth first: that of the channels.
void WriteJoint(const BodySurface& surface, int joint, int depth, std::vector<int>& order,
                Text out) {
  order.push_back(joint);
  const std::string indent(depth, '\t');
  const std::string inner(depth + 1, '\t');
  const int parent = kJointParents[joint];
  const Eigen::Matrix3Xd& rest = surface.RestJoints();
  fmt::format_to(out, "{}{} {}\n{}{{\n", indent, parent < 0 ? "ROOT" : "JOINT", kJointNames[joint],
                 indent);
  if (parent < 0) {
    // Programs differ in whether positions come in place of the offset or on top: both fit zero.
    WriteOffset(Eigen::Vector3d::Zero(), inner, out);
    fmt::format_to(
        out, "{}CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n", inner);
  } else {
    WriteOffset(rest.col(joint) - rest.col(parent), inner, out);
    fmt::format_to(out, "{}CHANNELS 3 Zrotation Xrotation Yrotation\n", inner);
  }
  bool is_leaf = true;
  for (int child = joint + 1; child < kNumJoints; ++child) {
    if (kJointParents[child] != joint) continue;
    is_leaf = false;
    WriteJoint(surface, child, depth + 1, order, out);
  }
  if (is_leaf) {
    fmt::format_to(out, "{}End Site\n{}{{\n", inner, inner);
    WriteOffset(EndSite(surface, joint), inner + '\t', out);
    fmt::format_to(out, "{}}}\n", inner);
  }
  fmt::format_to(out, "{}}}\n", indent);
}

}  // namespace

std::string BvhText(const Clip& clip, const BodySurface& surface) {
  std::string text = "HIERARCHY\n";
  const Text out = std::back_inserter(text);
  std::vector<int> order;
  WriteJoint(surface, 0, 0, order, out);
  fmt::format_to(out, "MOTION\nFrames: {}\nFrame Time: {:.9f}\n", clip.NumFrames(),
                 1 / clip.frame_rate);
  Eigen::Matrix3d y_up_from_z_up;
  y_up_from_z_up << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  Eigen::Matrix3Xd angles = Eigen::Matrix3Xd::Zero(3, kNumJoints);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    const Eigen::Vector3d root =
        kUnitsPerMetre * y_up_from_z_up * (surface.RestJoints().col(0) + clip.trans.col(t));
    fmt::format_to(out, "{:.6f} {:.6f} {:.6f}", root.x(), root.y(), root.z());
    for (const int joint : order) {
      Eigen::Matrix3d R = ExpSO3(clip.pose[t].col(joint));
      if (joint == 0) R = y_up_from_z_up * R;
      angles.col(joint) = EulerZxy(R, angles.col(joint));
      const Eigen::Vector3d degrees = kDegreesPerRadian * angles.col(joint);
      fmt::format_to(out, " {:.6f} {:.6f} {:.6f}", degrees[0], degrees[1], degrees[2]);
    }
    text += '\n';
  }
  return text;
}

void WriteBvh(const Clip& clip, const BodySurface& surface, const std::filesystem::path& path) {
  WriteAtomically(path, BvhText(clip, surface));
}

}  // namespace holdfast
