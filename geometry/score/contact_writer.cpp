// SPDX-License-Identifier: MIT
#include "geometry/score/contact_writer.h"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>

#include "geometry/body/body_kinematics.h"
#include "geometry/body/hand_model.h"
#include "geometry/io/container/atomic_file.h"
#include "geometry/io/container/npz.h"
#include "geometry/parallel.h"
#include "geometry/score/hand_object_score.h"

namespace holdfast {
namespace {

// 4 x 4, row-major.
void Append(const Eigen::Isometry3d& pose, std::vector<double>& values) {
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix = pose.matrix();
  values.insert(values.end(), matrix.data(), matrix.data() + matrix.size());
}

void Append(const Eigen::Vector3d& vector, std::vector<double>& values) {
  values.insert(values.end(), vector.begin(), vector.end());
}

void AddPoints(const ClipContactPoints& contacts, NpzWriter& npz) {
  const std::size_t n = contacts.points.size();
  std::vector<std::int64_t> frame, vertex;
  std::vector<std::uint8_t> hand, part;
  std::vector<double> depth, in_object, in_world, normal_in_object, normal_in_world;
  for (const ContactPoint& point : contacts.points) {
    const Eigen::Isometry3d& world_from_object = contacts.object[point.frame];
    frame.push_back(point.frame);
    vertex.push_back(point.vertex);
    hand.push_back(HoldingBit(point.side));
    part.push_back(static_cast<std::uint8_t>(point.part));
    depth.push_back(point.depth_m);
    Append(point.in_object, in_object);
    Append(world_from_object * point.in_object, in_world);
    Append(point.normal_in_object, normal_in_object);
    Append(world_from_object.linear() * point.normal_in_object, normal_in_world);
  }
  npz.AddInt64("contact_frame", {n}, std::move(frame));
  npz.AddUint8("contact_hand", {n}, std::move(hand));
  npz.AddUint8("contact_part", {n}, std::move(part));
  npz.AddInt64("contact_vertex", {n}, std::move(vertex));
  npz.AddFloat64("contact_depth", {n}, std::move(depth));
  npz.AddFloat64("contact_point_object", {n, 3}, std::move(in_object));
  npz.AddFloat64("contact_point_world", {n, 3}, std::move(in_world));
  npz.AddFloat64("contact_normal_object", {n, 3}, std::move(normal_in_object));
  npz.AddFloat64("contact_normal_world", {n, 3}, std::move(normal_in_world));
}

std::string PoseRow(int frame, double time_s, std::string_view hand, std::string_view link,
                    const Eigen::Isometry3d& pose) {
  Eigen::Quaterniond q(pose.linear());
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  const auto at = pose.translation();
  return fmt::format("{},{:.6f},{},{},{:.7f},{:.7f},{:.7f},{:.7f},{:.7f},{:.7f},{:.7f}\n", frame,
                     time_s, hand, link, at.x(), at.y(), at.z(), q.w(), q.x(), q.y(), q.z());
}

}  // namespace

void WriteContactsNpz(const ClipContactPoints& contacts, const std::filesystem::path& path) {
  const std::size_t frames = contacts.object.size();
  const std::size_t hands = contacts.hands.size();
  std::vector<double> object, wrists, tips;
  for (std::size_t t = 0; t < frames; ++t) {
    Append(contacts.object[t], object);
    for (const HandPose& hand : contacts.hand_poses[t]) {
      Append(hand.wrist, wrists);
      for (const Eigen::Isometry3d& tip : hand.tips) Append(tip, tips);
    }
  }
  std::vector<std::uint8_t> bits;
  for (const Side side : contacts.hands) bits.push_back(HoldingBit(side));
  NpzWriter npz;
  npz.AddFloat64("frame_rate", {}, {contacts.frame_rate});
  npz.AddText("object_name", contacts.object_name);
  npz.AddFloat64("contact_threshold", {}, {contacts.threshold_m});
  npz.AddUint8("hands", {hands}, std::move(bits));
  npz.AddFloat64("object_pose", {frames, 4, 4}, std::move(object));
  npz.AddFloat64("wrist_pose", {frames, hands, 4, 4}, std::move(wrists));
  npz.AddFloat64("fingertip_pose", {frames, hands, 5, 4, 4}, std::move(tips));
  AddPoints(contacts, npz);
  npz.Write(path);
}

void WriteContactsCsv(const ClipContactPoints& contacts, const std::filesystem::path& path,
                      const std::filesystem::path& poses_path) {
  std::string table =
      "frame,time_s,hand,part,vertex,depth_m,world_x_m,world_y_m,world_z_m,world_normal_x,"
      "world_normal_y,world_normal_z,object_x_m,object_y_m,object_z_m,object_normal_x,"
      "object_normal_y,object_normal_z\n";
  for (const ContactPoint& point : contacts.points) {
    const Eigen::Isometry3d& world_from_object = contacts.object[point.frame];
    fmt::format_to(std::back_inserter(table), "{},{:.6f},{},{},{},{:.7f}", point.frame,
                   point.frame / contacts.frame_rate, SideName(point.side), kHandParts[point.part],
                   point.vertex, point.depth_m);
    for (const Eigen::Vector3d& vector :
         {Eigen::Vector3d(world_from_object * point.in_object),
          Eigen::Vector3d(world_from_object.linear() * point.normal_in_object), point.in_object,
          point.normal_in_object}) {
      fmt::format_to(std::back_inserter(table), ",{:.7f},{:.7f},{:.7f}", vector.x(), vector.y(),
                     vector.z());
    }
    table += '\n';
  }
  std::string poses = "frame,time_s,hand,link,x_m,y_m,z_m,qw,qx,qy,qz\n";
  for (std::size_t k = 0; k < contacts.object.size(); ++k) {
    const auto t = static_cast<int>(k);
    const double time_s = t / contacts.frame_rate;
    poses += PoseRow(t, time_s, "", "object", contacts.object[k]);
    for (std::size_t h = 0; h < contacts.hands.size(); ++h) {
      const std::string_view side = SideName(contacts.hands[h]);
      const HandPose& hand = contacts.hand_poses[k][h];
      poses += PoseRow(t, time_s, side, "wrist", hand.wrist);
      for (int tip = 0; tip < 5; ++tip) {
        poses += PoseRow(t, time_s, side, kHandParts[tip + 1], hand.tips[tip]);
      }
    }
  }
  WriteAtomically(poses_path, poses);
  WriteAtomically(path, table);
}

namespace {

// Fingers in the order of a hand's joints, as indices into kHandParts.
constexpr std::array<int, 5> kPartOfFinger = {2, 3, 5, 4, 1};

// Data that is constant over all frames.
struct Hand {
  Hand(std::shared_ptr<const BodyModel> body, const Eigen::VectorXd& betas, Side side)
      : model(std::move(body), betas, side) {
    const int first = HandBegin(side);
    for (int v = 0; v < model.NumVertices(); ++v) {
      const auto weights = model.Surface().Weights(v);
      const int joint = std::max_element(weights.begin(), weights.end(), [](auto& a, auto& b) {
                          return a.second < b.second;
                        })->first;
      const bool is_finger = joint >= first && joint < first + kJointsPerHand;
      part.push_back(is_finger ? kPartOfFinger[(joint - first) / 3] : 0);
    }
    for (int finger = 0; finger < 5; ++finger) {
      tip[kPartOfFinger[finger] - 1] = EndSite(model.Surface(), first + 3 * finger + 2);
    }
  }

  HandModel model;
  std::vector<int> part;               // per vertex
  std::array<Eigen::Vector3d, 5> tip;  // thumb to pinky, from the last joint, T-pose
};

HandPose PoseOf(const HandState& state, const Hand& hand) {
  HandPose pose;
  pose.wrist = state.WorldFromWrist();
  for (int finger = 0; finger < 5; ++finger) {
    const int joint = 3 * finger + 2;
    const int tip = kPartOfFinger[finger] - 1;
    const Eigen::Matrix3d& rotation = state.JointRotation(joint);
    pose.tips[tip] =
        RigidTransform(rotation, state.JointPositions().col(joint) + rotation * hand.tip[tip]);
  }
  return pose;
}

}  // namespace

ClipContactPoints FindContactPoints(const Clip& clip, std::shared_ptr<const BodyModel> body,
                                    const Eigen::VectorXd& betas, const SignedDistance& object,
                                    double threshold_m, int threads) {
  ClipContactPoints result;
  result.object = ObjectPoses(clip);
  result.frame_rate = clip.frame_rate;
  result.object_name = clip.object->name;
  result.threshold_m = threshold_m;
  std::vector<Hand> hands;
  for (const Side side : {Side::kRight, Side::kLeft}) {
    if (!body->HasHand(side)) continue;
    hands.emplace_back(body, betas, side);
    result.hands.push_back(side);
  }
  const auto frames = static_cast<std::size_t>(clip.NumFrames());
  result.hand_poses.resize(frames);
  std::vector<std::vector<ContactPoint>> points(frames);
  ParallelFor(clip.NumFrames(), threads, [&](int t) {
    const Eigen::Isometry3d object_from_world = result.object[t].inverse();
    for (const Hand& hand : hands) {
      const Side side = hand.model.HandSide();
      HandState state(hand.model);
      state.SetBody(clip.pose[t], clip.trans.col(t));
      state.Evaluate(FingersOf(clip.pose[t], side), false);
      result.hand_poses[t].push_back(PoseOf(state, hand));
      const Eigen::Matrix3Xd vertices = object_from_world * state.Vertices();
      for (int v = 0; v < hand.model.NumVertices(); ++v) {
        const SignedDistance::Result nearest = object.Query(vertices.col(v));
        if (nearest.distance >= threshold_m) continue;
        points[t].push_back({t, side, hand.part[v], hand.model.Surface().VertexIds()[v],
                             -nearest.distance, nearest.closest, nearest.gradient});
      }
    }
  });
  for (const auto& of_frame : points) {
    result.points.insert(result.points.end(), of_frame.begin(), of_frame.end());
  }
  return result;
}

}  // namespace holdfast
