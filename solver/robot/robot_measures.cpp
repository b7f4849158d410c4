// SPDX-License-Identifier: MIT
#include "solver/robot/robot_measures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "geometry/mesh/surface_distance.h"
#include "geometry/mesh/triangle_tree.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"
#include "solver/grasp/grasp_candidates.h"
#include "solver/robot/contact_file.h"
#include "solver/robot/human_demonstration.h"

namespace holdfast {
namespace {

constexpr double kTouching_m = 0.003;
constexpr double kFriction = 0.6;  // lower than rubber on most materials
constexpr double kDensity_kg_m3 = 500.0, kLightest_kg = 0.05, kHeaviest_kg = 0.5;
constexpr double kSqueeze = 8.0, kMinSqueeze_N = 10.0;  // in weights of the object
constexpr double kTurning_Nm = 3.0, kSliding_N_m = 1000.0;

GrippedSolid SolidOf(const TriangleMesh& mesh) {
  GrippedSolid solid;
  solid.center = SolidCentroid(mesh);
  solid.radius_m = (mesh.vertices.colwise() - solid.center).colwise().norm().maxCoeff();
  solid.mass_kg =
      std::clamp(kDensity_kg_m3 * std::abs(SignedVolume(mesh)), kLightest_kg, kHeaviest_kg);
  return solid;
}

// Stiffness of each degree of freedom: the sum over all joints that it moves.
Eigen::VectorXd StiffnessOf(const RobotHand& hand) {
  Eigen::VectorXd stiffness = Eigen::VectorXd::Zero(hand.NumDofs());
  for (const RobotLink& link : hand.links) {
    if (link.dof < 0) continue;
    stiffness(link.dof) += link.factor * link.factor *
                           (link.kind == RobotJointKind::kSliding ? kSliding_N_m : kTurning_Nm);
  }
  return stiffness;
}

}  // namespace

std::vector<GripContact> TouchesOfRobot(const RobotTransferSetup& setup, const PosedRobot& posed,
                                        double touch_m) {
  constexpr double kGridError_m = 0.005, kApart_m = 0.01;
  constexpr int kMaxOfLink = 3;
  const Eigen::Isometry3d root_from_object = posed.Pose().ObjectFromRoot().inverse();
  std::vector<GripContact> contacts;
  for (const int link : setup.solids->Links()) {
    std::vector<SignedDistance::Result> near;
    for (const auto sample : setup.solids->Of(link).samples.colwise()) {
      const Eigen::Vector3d point = posed.ObjectFromLink(link) * sample;
      if (setup.object_grid->Linear(point) > touch_m + kGridError_m) continue;
      const SignedDistance::Result hit = setup.object_distance->Query(point);
      if (hit.distance < touch_m) near.push_back(hit);
    }
    std::ranges::stable_sort(near, {}, &SignedDistance::Result::distance);
    const std::size_t first = contacts.size();
    for (const SignedDistance::Result& hit : near) {
      const Eigen::Vector3d point = root_from_object * hit.closest;
      const bool apart = std::all_of(
          contacts.begin() + static_cast<std::ptrdiff_t>(first), contacts.end(),
          [&](const GripContact& known) { return (known.point - point).norm() > kApart_m; });
      if (!apart) continue;
      contacts.push_back({link, point, -(root_from_object.linear() * hit.gradient),
                          Eigen::Vector3d::Zero(), std::max(0.0, hit.distance)});
      if (contacts.size() == first + kMaxOfLink) break;
    }
  }
  return contacts;
}

Eigen::MatrixXd ContactSlopes(const RobotState& state, const std::vector<GripContact>& contacts) {
  Eigen::MatrixXd slopes(3 * std::ssize(contacts), state.Hand().NumDofs());
  for (Eigen::Index c = 0; c < std::ssize(contacts); ++c) {
    const GripContact& contact = contacts[c];
    slopes.middleRows(3 * c, 3) = state.PointJacobian(contact.link, contact.point);
  }
  return slopes;
}

double GiveInRobot_m(const RobotTransferSetup& setup, const PosedRobot& posed) {
  GripGiveOptions options;
  options.friction = kFriction;
  GrippedSolid solid = SolidOf(setup.object);
  solid.center = posed.Pose().ObjectFromRoot().inverse() * solid.center;
  std::vector<GripContact> contacts = TouchesOfRobot(setup, posed, kTouching_m);
  BalancePresses(solid.center, solid.radius_m, options.friction,
                 std::max(kMinSqueeze_N, kSqueeze * solid.mass_kg * options.gravity_m_s2),
                 contacts);
  return GripGive(contacts, ContactSlopes(posed.State(), contacts), StiffnessOf(setup.robot), solid,
                  options);
}

namespace {

constexpr double kSpacing_m = 0.0025;
constexpr int kMaxOfLink = 600, kMaxOfObject = 6000;
constexpr double kTouch_m = 0.005;

double AngleOf(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::acos(std::clamp(a.dot(b) / (a.norm() * b.norm()), -1.0, 1.0));
}

RobotContact Compared(const PartContact& contact, int link, const Eigen::Vector3d& point,
                      const Eigen::Vector3d& normal) {
  RobotContact out;
  out.part = contact.part;
  out.link = link;
  out.point = point;
  out.normal = normal;
  out.distance_m = (point - contact.point).norm();
  out.angle_rad = AngleOf(-normal, contact.normal);
  return out;
}

// Faces of the skin of each part.
std::array<Eigen::Matrix3Xi, kNumHandParts> PartFaces(const RobotTransferSetup& setup) {
  const auto& faces = setup.human->Surface().Faces();
  std::array<std::vector<Eigen::Index>, kNumHandParts> of_part;
  for (Eigen::Index f = 0; f < faces.cols(); ++f) {
    const int part = setup.landmarks->PartOf(faces(0, f));
    const bool whole = part >= 0 && part == setup.landmarks->PartOf(faces(1, f)) &&
                       part == setup.landmarks->PartOf(faces(2, f));
    if (whole) of_part[part].push_back(f);
  }
  std::array<Eigen::Matrix3Xi, kNumHandParts> out;
  for (std::size_t part = 0; part < out.size(); ++part) {
    out[part] = faces(Eigen::all, of_part[part]);
  }
  return out;
}

class TransferMeter {
 public:
  explicit TransferMeter(const RobotTransferSetup& setup)
      : setup_(setup), keypoints_(setup.robot, setup.anatomy) {
    for (const int link : setup.solids->Links()) {
      samples_[link] = ContactSamples(setup.solids->Of(link).mesh, kSpacing_m, kMaxOfLink);
    }
    object_samples_ = ContactSamples(setup.object, kSpacing_m, kMaxOfObject);
  }

  // The expensive measures: depths, and the give while holding.
  RobotFrameMeasure MeasurePose(const RobotPose& pose, bool holds) const {
    PosedRobot posed(setup_.robot);
    posed.Set(pose);
    RobotFrameMeasure out;
    MeasureDepth(posed, out);
    if (holds) out.give_mm = 1e3 * GiveInRobot_m(setup_, posed);
    return out;
  }

  void MeasureContacts(const HumanFrame& frame, const RobotPose& pose,
                       RobotFrameMeasure& out) const {
    PosedRobot posed(setup_.robot);
    posed.Set(pose);
    for (const PartContact& contact : frame.contacts) {
      out.contacts.push_back(Nearest(contact, posed));
      CompareBone(frame, posed, out.contacts.back());
    }
  }

 private:
  void MeasureDepth(const PosedRobot& posed, RobotFrameMeasure& out) const {
    for (const int link : setup_.solids->Links()) {
      const LinkSolid& solid = setup_.solids->Of(link);
      const Eigen::Isometry3d& pose = posed.ObjectFromLink(link);
      const Eigen::Vector3d center = pose * solid.center;
      if (setup_.object_distance->Distance(center) > solid.radius) continue;
      for (const auto sample : samples_.at(link).colwise()) {
        const Eigen::Vector3d x = pose * sample;
        if (setup_.object_grid->Linear(x) > 0.001) continue;
        out.hand_in_object_mm =
            std::max(out.hand_in_object_mm, -1e3 * setup_.object_distance->Distance(x));
      }
      const Eigen::Isometry3d link_from_object = pose.inverse();
      for (const auto x : object_samples_.colwise()) {
        if ((x - center).norm() > solid.radius) continue;
        const Eigen::Vector3d in_link = link_from_object * x;
        if (solid.grid->Linear(in_link) > 0.001) continue;
        out.object_in_hand_mm =
            std::max(out.object_in_hand_mm, -1e3 * solid.distance->Distance(in_link));
      }
    }
    for (const auto& [a, b] : setup_.solids->Pairs()) {
      for (const auto& [from, into] : {std::pair{a, b}, std::pair{b, a}}) {
        const Eigen::Isometry3d into_from =
            posed.ObjectFromLink(into).inverse() * posed.ObjectFromLink(from);
        const LinkSolid& solid = setup_.solids->Of(into);
        for (const auto sample : setup_.solids->Of(from).samples.colwise()) {
          const Eigen::Vector3d x = into_from * sample;
          if ((x - solid.center).norm() > solid.radius) continue;
          out.self_mm = std::max(out.self_mm, -1e3 * solid.grid->Distance(x));
        }
      }
    }
  }

  RobotContact Nearest(const PartContact& contact, const PosedRobot& posed) const {
    const std::optional<PadPoint> pad = setup_.pads.Nearest(contact.part, posed, contact.point);
    const Eigen::Isometry3d& pose = posed.ObjectFromLink(pad->link);
    RobotContact out = Compared(contact, pad->link, pose * pad->point, pose.linear() * pad->normal);
    const std::optional<PadPoint> touch =
        setup_.pads.Touching(contact.part, posed, *setup_.object_grid);
    const SignedDistance::Result hit =
        setup_.object_distance->Query(posed.ObjectFromLink(touch->link) * touch->point);
    out.press_rad = AngleOf(hit.gradient, contact.normal);
    out.gap_m = std::max(0.0, hit.distance);
    return out;
  }

  void CompareBone(const HumanFrame& frame, const PosedRobot& posed, RobotContact& contact) const {
    if (contact.part >= kJointsPerHand) return;
    const auto finger = std::ranges::find(keypoints_.human_fingers, contact.part / 3);
    if (finger == keypoints_.human_fingers.end()) return;
    const auto f = static_cast<std::size_t>(finger - keypoints_.human_fingers.begin());
    const int phalanx = contact.part % 3;
    const std::size_t joint = 3 * f + static_cast<std::size_t>(phalanx);
    const Eigen::Vector3d begin = keypoints_.joints[joint].At(posed);
    const Eigen::Vector3d end =
        (phalanx == 2 ? keypoints_.tips[f] : keypoints_.joints[joint + 1]).At(posed);
    const Eigen::Vector3d human_end = phalanx == 2 ? Eigen::Vector3d(frame.tips.col(*finger))
                                                   : frame.joints.col(contact.part + 1);
    contact.bone_rad = AngleOf(end - begin, human_end - frame.joints.col(contact.part));
    contact.bone_m = (end - human_end).norm();
  }

  const RobotTransferSetup& setup_;
  RobotKeypoints keypoints_;
  std::map<int, Eigen::Matrix3Xd> samples_;
  Eigen::Matrix3Xd object_samples_;
};

RobotMeasures Summed(std::vector<RobotFrameMeasure> frames) {
  RobotMeasures out;
  out.frames = std::move(frames);
  int touching = 0, kept = 0;
  std::vector<double> gives;
  for (const RobotFrameMeasure& frame : out.frames) {
    out.hold_frames += !frame.contacts.empty();
    if (!std::isnan(frame.give_mm)) gives.push_back(frame.give_mm);
    out.deepest_mm = std::max(out.deepest_mm, frame.Deepest_mm());
    out.mean_deepest_mm += frame.Deepest_mm() / static_cast<double>(out.frames.size());
    out.frames_deeper_than_2_mm += frame.Deepest_mm() > 2.0;
    out.self_mm = std::max(out.self_mm, frame.self_mm);
    for (const RobotContact& contact : frame.contacts) {
      ++out.contacts;
      out.contact_mm += 1e3 * contact.distance_m;
      out.angle_deg += contact.angle_rad / kDegree;
      out.press_deg += contact.press_rad / kDegree;
      if (!std::isnan(contact.bone_rad)) {
        ++out.bones;
        out.bone_deg += contact.bone_rad / kDegree;
        out.bone_mm += 1e3 * contact.bone_m;
      }
      touching += contact.distance_m < kTouch_m;
      kept += contact.gap_m < kTouch_m;
    }
  }
  if (out.contacts > 0) {
    out.contact_mm /= out.contacts;
    out.angle_deg /= out.contacts;
    out.press_deg /= out.contacts;
    out.touching_ratio = static_cast<double>(touching) / out.contacts;
    out.kept_ratio = static_cast<double>(kept) / out.contacts;
  }
  if (!gives.empty()) {
    const auto middle = gives.begin() + std::ssize(gives) / 2;
    std::ranges::nth_element(gives, middle);
    out.give_mm = *middle;
  }
  out.bone_deg /= out.bones;
  out.bone_mm /= out.bones;
  return out;
}

}  // namespace

double RobotFrameMeasure::Deepest_mm() const {
  return std::max(hand_in_object_mm, object_in_hand_mm);
}

double RobotFrameMeasure::ContactDistance_mm() const {
  double sum = 0.0;
  for (const RobotContact& contact : contacts) sum += 1e3 * contact.distance_m;
  return sum / static_cast<double>(contacts.size());
}

double RobotFrameMeasure::ContactAngle_deg() const {
  double sum = 0.0;
  for (const RobotContact& contact : contacts) sum += contact.angle_rad / kDegree;
  return sum / static_cast<double>(contacts.size());
}

RobotMeasures MeasureTransfer(const RobotTransferSetup& setup, const std::vector<RobotPose>& poses,
                              int threads) {
  const TransferMeter meter(setup);
  const std::vector<HumanFrame>& human = setup.demonstration.frames;
  const int count = static_cast<int>(poses.size());
  // An unchanged grasp is measured once.
  std::vector<int> first(poses.size(), 0);
  for (int t = 1; t < count; ++t) {
    const RobotPose &here = poses[t], &before = poses[t - 1];
    const bool stays = here.R == before.R && here.T == before.T && here.q == before.q &&
                       human[t].contacts.empty() == human[t - 1].contacts.empty();
    first[t] = stays ? first[t - 1] : t;
  }
  std::vector<RobotFrameMeasure> frames(poses.size());
  ParallelFor(count, threads, [&](int t) {
    if (first[t] == t) frames[t] = meter.MeasurePose(poses[t], !human[t].contacts.empty());
  });
  for (int t = 1; t < count; ++t) frames[t] = frames[first[t]];
  ParallelFor(count, threads, [&](int t) { meter.MeasureContacts(human[t], poses[t], frames[t]); });
  return Summed(std::move(frames));
}

RobotMeasures MeasureHuman(const RobotTransferSetup& setup, int threads) {
  const std::array<Eigen::Matrix3Xi, kNumHandParts> faces = PartFaces(setup);
  std::vector<RobotFrameMeasure> frames(setup.demonstration.frames.size());
  ParallelFor(static_cast<int>(frames.size()), threads, [&](int t) {
    const HumanFrame& frame = setup.demonstration.frames[t];
    frames[t].hand_in_object_mm = std::max(0.0, -1e3 * frame.distance.minCoeff());
    for (const PartContact& contact : frame.contacts) {
      const TriangleMesh skin{frame.vertices, faces[contact.part]};
      const TriangleTree::Hit hit = TriangleTree(skin).Closest(contact.point);
      frames[t].contacts.push_back(
          Compared(contact, 0, hit.point, FaceCross(skin, hit.face).normalized()));
    }
  });
  return Summed(std::move(frames));
}

std::vector<std::string> LostParts(const RobotMeasures& measures) {
  std::map<int, std::pair<int, int>> parts;  // frames in which contact is lost, and all
  for (const RobotFrameMeasure& frame : measures.frames) {
    for (const RobotContact& contact : frame.contacts) {
      auto& [lost, frames] = parts[contact.part];
      ++frames;
      lost += contact.gap_m >= kTouch_m;
    }
  }
  std::vector<std::string> texts;
  for (const auto& [part, counts] : parts) {
    const auto& [lost, frames] = counts;
    if (2 * lost <= frames) continue;
    texts.push_back(fmt::format("{} ({} of {} frames)", HandPartName(part), lost, frames));
  }
  return texts;
}

nlohmann::json RobotMeasuresJson(const RobotMeasures& measures) {
  return {{"contact_distance_mm", measures.contact_mm},
          {"contact_normal_deg", measures.angle_deg},
          {"press_direction_deg", measures.press_deg},
          {"bone_direction_deg", measures.bone_deg},
          {"bone_end_mm", measures.bone_mm},
          {"bones", measures.bones},
          {"contacts_kept_ratio", measures.kept_ratio},
          {"contacts_within_5_mm_ratio", measures.touching_ratio},
          {"contacts", measures.contacts},
          {"hold_frames", measures.hold_frames},
          {"max_penetration_depth_mm", measures.deepest_mm},
          {"mean_max_penetration_depth_mm", measures.mean_deepest_mm},
          {"frames_deeper_than_2_mm", measures.frames_deeper_than_2_mm},
          {"self_penetration_mm", measures.self_mm},
          {"give_mm", measures.give_mm}};
}

nlohmann::json RobotProtocolJson() {
  return {{"contact",
           "for each human hand part (15 phalanges, palm) whose pad is within touch_mm of the "
           "object: distance from the weighted mean of its contact points to the nearest point of "
           "the corresponding pad of the robot"},
          {"touch_mm", 1e3 * kDemonstratedTouch_m},
          {"contact_kept_mm", 1e3 * kTouch_m},
          {"give",
           "displacement of the object in the hand under its own weight, median over the frames in "
           "which the hand holds it: joints are springs of 3 N m per radian, friction 0.6"},
          {"penetration",
           "in both directions: exact signed distance of points on one surface to the other"},
          {"spacing_mm", 1e3 * kSpacing_m}};
}

}  // namespace holdfast
