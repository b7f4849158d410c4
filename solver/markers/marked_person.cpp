// SPDX-License-Identifier: MIT
#include "solver/markers/marked_person.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "generator/body/limb_ik.h"
#include "geometry/body/body_kinematics.h"
#include "geometry/rotation.h"
#include "solver/hand/hand_landmarks.h"

namespace holdfast {
namespace {

constexpr int kMaxBetas = 10;
constexpr double kLimitSigma_rad = 0.03;
constexpr double kPatch_m = 0.12;  // radius of the skin around a marker

// Standard deviations of a joint's rotation along `axes` (columns), degrees, and of its
// acceleration, rad / s^2.
struct JointEase {
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d sigma_deg = Eigen::Vector3d::Constant(10.0);
  double acceleration = 40.0;
};

JointEase EaseOf(int joint) {
  JointEase ease;
  const auto all = [&](double degrees, double acceleration) {
    ease.sigma_deg.setConstant(degrees);
    ease.acceleration = acceleration;
  };
  const bool left = MirrorJoint(joint) > joint;
  const Side side = left ? Side::kLeft : Side::kRight;
  const int right = left ? MirrorJoint(joint) : joint;
  switch (right) {
    case kSpine1:
    case kSpine2:
    case kSpine3:
      all(8.0, 30.0);
      break;
    case kNeck:
    case kHead:
      all(15.0, 40.0);
      break;
    case kRightCollar:
      all(12.0, 40.0);
      break;
    case kRightShoulder:
      all(120.0, 120.0);
      break;
    case kRightElbow: {
      const Eigen::Vector3d hinge = Arm(side).hinge;
      ease.axes << hinge, Eigen::Vector3d::UnitX(), hinge.cross(Eigen::Vector3d::UnitX());
      ease.axes.col(2).normalize();
      ease.sigma_deg << 90.0, 60.0, 6.0;
      ease.acceleration = 120.0;
      break;
    }
    case kRightWrist:
      ease.axes << Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY();
      ease.sigma_deg << 40.0, 8.0, 20.0;
      ease.acceleration = 150.0;
      break;
    case kRightHip:
      ease.sigma_deg << 60.0, 30.0, 30.0;
      ease.acceleration = 80.0;
      break;
    case kRightKnee:
      ease.sigma_deg << 90.0, 6.0, 4.0;
      ease.acceleration = 100.0;
      break;
    case kRightAnkle:
      ease.sigma_deg << 25.0, 20.0, 12.0;
      ease.acceleration = 100.0;
      break;
    default:
      all(15.0, 80.0);
  }
  return ease;
}

// `marked`: joints driven by markers. Legs among them are near standing and walking, whatever the
// posture of legs without markers.
JointPose RestPose(const std::array<HandAngles, 2>& relaxed, const std::array<HandAxes, 2>& axes,
                   RestPosture posture, const std::vector<int>& marked) {
  JointPose rest = JointPose::Zero();
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const int s = side == Side::kRight ? 0 : 1;
    SetFingers(rest, side, axes[s].PoseOf(relaxed[s]));
    // Arms without markers hang, with collars lower than in the T-pose.
    const double sign = side == Side::kRight ? 1.0 : -1.0;
    rest.col(side == Side::kRight ? kRightShoulder : kLeftShoulder).z() = sign * 75.0 * kDegree;
    rest.col(side == Side::kRight ? kRightCollar : kLeftCollar).z() = sign * 14.0 * kDegree;
  }
  for (const int hip : {kLeftHip, kRightHip}) {
    const int knee = hip + kLeftKnee - kLeftHip;
    const bool moves = std::ranges::count(marked, hip) > 0;
    if (!moves && posture != RestPosture::kSeated) continue;
    rest(0, hip) = (moves ? -10.0 : -90.0) * kDegree;
    rest(0, knee) = (moves ? 15.0 : 90.0) * kDegree;
  }
  return rest;
}

// A variable of a hand: the angles (row, finger joint) that it drives, with factors.
struct HandNumber {
  struct Part {
    int row, joint;
    double share;
  };
  std::vector<Part> parts;
  double sigma_deg;
};

std::vector<HandNumber> HandNumbers(const std::set<int>& marked) {
  std::vector<HandNumber> numbers;
  const std::array<int, 4> order = {kIndex, kMiddle, kRing, kPinky};
  for (const int finger : order) {
    if (!marked.contains(finger)) continue;
    HandNumber base{.parts = {}, .sigma_deg = 25.0}, beyond{.parts = {}, .sigma_deg = 25.0};
    const auto position = [&](int f) { return std::ranges::find(order, f) - order.begin(); };
    for (const int other : order) {
      // The nearest marked finger leads; of two equally near ones, the earlier.
      int leader = -1;
      for (const int m : order) {
        if (!marked.contains(m)) continue;
        if (leader < 0 || std::abs(position(m) - position(other)) <
                              std::abs(position(leader) - position(other))) {
          leader = m;
        }
      }
      if (leader != finger) continue;
      base.parts.push_back({0, 3 * other, 1.0});
      beyond.parts.push_back({0, 3 * other + 1, 1.0});
      beyond.parts.push_back({0, 3 * other + 2, 0.65});
    }
    // The leader's own angle first: its limit applies to the variable.
    std::ranges::stable_sort(base.parts, {}, [&](const auto& p) { return p.joint / 3 != finger; });
    std::ranges::stable_sort(beyond.parts, {},
                             [&](const auto& p) { return p.joint / 3 != finger; });
    numbers.push_back(base);
    numbers.push_back(beyond);
    numbers.push_back({.parts = {{1, 3 * finger, 1.0}}, .sigma_deg = 7.0});
  }
  if (marked.contains(kThumb)) {
    numbers.push_back({.parts = {{0, 3 * kThumb, 1.0}}, .sigma_deg = 15.0});
    numbers.push_back({.parts = {{1, 3 * kThumb, 1.0}}, .sigma_deg = 12.0});
    numbers.push_back(
        {.parts = {{0, 3 * kThumb + 1, 1.0}, {0, 3 * kThumb + 2, 1.0}}, .sigma_deg = 20.0});
  }
  return numbers;
}

// Mean angles of captured drinking and combing (hands that rest on a table, reach and hold) with
// markers on index and thumb. Flexion (row 0) and spread (row 1), radians.
double UsualAngle(int row, int finger_joint) {
  const bool thumb = finger_joint / 3 == kThumb, base = finger_joint % 3 == 0;
  if (row == 1) return (thumb ? 17.0 : -3.0) * kDegree;
  if (thumb) return (base ? 7.0 : 15.0) * kDegree;
  return (base ? 26.0 : 12.0) * kDegree;
}

// Normal prior of the hand variables around those angles, with the covariance of grasp postures:
// their mean and the root of their information.
std::pair<Eigen::VectorXd, Eigen::MatrixXd> PriorOf(const std::vector<HandNumber>& numbers,
                                                    const HandAnatomy& hand,
                                                    const HandAngles& relaxed) {
  std::vector<HandAngles> postures = {OpenHand(hand.axes), relaxed};
  for (const double width : {0.01, 0.03, 0.05, 0.07, 0.09}) {
    postures.push_back(PinchHand(hand, width));
  }
  const Eigen::Index m = static_cast<Eigen::Index>(numbers.size());
  Eigen::MatrixXd h(m, static_cast<Eigen::Index>(postures.size()));
  Eigen::VectorXd mean(m);
  for (Eigen::Index k = 0; k < m; ++k) {
    const HandNumber::Part& part = numbers[k].parts.front();
    const double now = relaxed(part.row, part.joint);
    for (Eigen::Index p = 0; p < h.cols(); ++p) h(k, p) = postures[p](part.row, part.joint) - now;
    mean(k) = UsualAngle(part.row, part.joint) - now;
  }
  h.colwise() -= Eigen::VectorXd(h.rowwise().mean());
  Eigen::MatrixXd covariance = h * h.transpose() / static_cast<double>(h.cols());
  for (Eigen::Index k = 0; k < m; ++k) {
    const double sigma = numbers[k].sigma_deg * kDegree;
    covariance(k, k) += sigma * sigma;
  }
  const Eigen::MatrixXd information = covariance.llt().solve(Eigen::MatrixXd::Identity(m, m));
  const Eigen::MatrixXd root_information = information.llt().matrixU();
  return {mean, root_information};
}

std::vector<int> FreeJoints(const std::vector<MarkerSite>& sites) {
  std::set<int> joints;
  for (const MarkerSite& site : sites) {
    for (int a = site.joint; a > 0; a = kJointParents[a]) {
      if (a < kLeftHandBegin) joints.insert(a);
    }
  }
  return {joints.begin(), joints.end()};
}

// Whether `other` is the joint itself, its parent or a child.
bool IsNextTo(int joint, int other) {
  return other == joint || kJointParents[other] == joint || kJointParents[joint] == other;
}

// Returns the vertex farthest from `from` along `out` within 1.5 cm of that line.
int SkinVertex(const BodySurface& surface, const std::vector<int>& joint_of_vertex, int joint,
               const Eigen::Vector3d& from, const Eigen::Vector3d& out) {
  int best = -1;
  double farthest = 0.0;
  for (int i = 0; i < surface.NumVertices(); ++i) {
    if (!IsNextTo(joint, joint_of_vertex[i])) continue;
    const Eigen::Vector3d x = surface.RestVertices().col(i) - from;
    const double along = x.dot(out);
    if ((x - along * out).norm() > 0.015 || along <= farthest) continue;
    farthest = along;
    best = i;
  }
  return best;
}

// Skin around a T-pose position (world); `shaped`: vertices with each beta set to 1.
SkinPatch PatchAbout(const Eigen::Vector3d& place, int joint,
                     const std::vector<int>& joint_of_vertex, const BodySurface& surface,
                     const std::vector<Eigen::Matrix3Xd>& shaped,
                     const std::vector<Eigen::Matrix3Xd>& shaped_joints) {
  std::vector<int> ids, place_of(static_cast<std::size_t>(surface.NumVertices()), -1);
  for (int i = 0; i < surface.NumVertices(); ++i) {
    if (!IsNextTo(joint, joint_of_vertex[i])) continue;
    if ((surface.RestVertices().col(i) - place).norm() > kPatch_m) continue;
    place_of[i] = static_cast<int>(ids.size());
    ids.push_back(i);
  }
  SkinPatch patch;
  const auto n = static_cast<Eigen::Index>(ids.size());
  patch.vertices =
      surface.RestVertices()(Eigen::all, ids).colwise() - surface.RestJoints().col(joint);
  patch.ids = ids;
  patch.J_betas.resize(3 * n, static_cast<Eigen::Index>(shaped.size()));
  for (std::size_t b = 0; b < shaped.size(); ++b) {
    const Eigen::Matrix3Xd change =
        (shaped[b](Eigen::all, ids).colwise() - shaped_joints[b].col(joint)) - patch.vertices;
    patch.J_betas.col(b) = change.reshaped();
  }
  std::vector<int> corners;
  for (Eigen::Index f = 0; f < surface.Faces().cols(); ++f) {
    const Eigen::Vector3i c = surface.Faces().col(f);
    if (place_of[c(0)] < 0 || place_of[c(1)] < 0 || place_of[c(2)] < 0) continue;
    for (const int corner : c) corners.push_back(place_of[corner]);
  }
  patch.faces = Eigen::Map<const Eigen::Matrix3Xi>(corners.data(), 3,
                                                   static_cast<Eigen::Index>(corners.size() / 3));
  return patch;
}

// Position of a site in the T-pose of a shape, relative to its joint. `vertex`: as for zero betas.
Eigen::Vector3d PlaceOf(const MarkerSite& site, int vertex, const Eigen::Matrix3Xd& vertices,
                        const Eigen::Matrix3Xd& joints, const Eigen::Vector3d& normal,
                        const Eigen::Vector3d& end) {
  const Eigen::Vector3d joint = joints.col(site.joint);
  if (vertex >= 0) return vertices.col(vertex) + kMarkerHeight_m * normal - joint;
  const Eigen::Vector3d way =
      site.toward >= 0 ? Eigen::Vector3d(joints.col(site.toward) - joint) : end;
  return site.fraction * way + site.outward;
}

void SetPlaces(const BodySurface& surface, MarkedPerson& person) {
  const BodyModel& model = *person.model;
  const int shapes = std::min(kMaxBetas, model.NumShape());
  const Eigen::Matrix3Xd rest = surface.RestVertices();
  person.body.rest_joints = surface.RestJoints();
  person.body.J_rest.resize(3 * kNumJoints, shapes);
  const int markers = static_cast<int>(person.sites.size());
  std::vector<int> vertices(markers, -1);
  std::vector<Eigen::Vector3d> normals(markers, Eigen::Vector3d::UnitY()), ends(markers);
  person.usual.resize(3 * markers);
  person.J_usual.resize(3 * markers, shapes);
  for (int k = 0; k < markers; ++k) {
    const MarkerSite& site = person.sites[k];
    ends[k] = site.toward < 0 ? EndSite(surface, site.joint) : Eigen::Vector3d::Zero();
    person.body.joint.push_back(site.joint);
    const Eigen::Vector3d joint = person.body.rest_joints.col(site.joint);
    if (site.outward.norm() > 0.0) normals[k] = site.outward.normalized();
    vertices[k] = site.vertex;
    if (site.vertex >= 0) {
      normals[k] = (rest.col(site.vertex) - joint).normalized();
    } else if (site.tie == MarkerTie::kSkin) {
      const Eigen::Vector3d way =
          site.toward >= 0 ? Eigen::Vector3d(person.body.rest_joints.col(site.toward) - joint)
                           : ends[k];
      vertices[k] = SkinVertex(surface, person.joint_of_vertex, site.joint,
                               joint + site.fraction * way, normals[k]);
    }
    person.usual.segment<3>(3 * k) =
        PlaceOf(site, vertices[k], rest, person.body.rest_joints, normals[k], ends[k]);
  }
  std::vector<Eigen::Matrix3Xd> shaped, shaped_joints;
  for (int b = 0; b < shapes; ++b) {
    shaped.push_back(model.ShapedVertices(Eigen::VectorXd::Unit(shapes, b)));
    shaped_joints.push_back(model.RestJoints(shaped.back()));
    const Eigen::Matrix3Xd change = shaped_joints.back() - person.body.rest_joints;
    person.body.J_rest.col(b) = Eigen::Map<const Eigen::VectorXd>(change.data(), change.size());
    for (int k = 0; k < markers; ++k) {
      person.J_usual.block<3, 1>(3 * k, b) = PlaceOf(person.sites[k], vertices[k], shaped.back(),
                                                     shaped_joints.back(), normals[k], ends[k]) -
                                             person.usual.segment<3>(3 * k);
    }
  }
  person.skin.resize(static_cast<std::size_t>(markers));
  for (int k = 0; k < markers; ++k) {
    const MarkerSite& site = person.sites[k];
    if (site.tie != MarkerTie::kSkin || vertices[k] < 0) continue;
    person.skin[k] =
        PatchAbout(person.body.rest_joints.col(site.joint) + person.usual.segment<3>(3 * k),
                   site.joint, person.joint_of_vertex, surface, shaped, shaped_joints);
  }
}

// Typical arms: hanging, forearms forward.
Eigen::Matrix3Xd BentPlaces(const MarkedPerson& person) {
  JointPose pose = JointPose::Zero();
  for (const Side side : {Side::kRight, Side::kLeft}) {
    const int shoulder = side == Side::kRight ? kRightShoulder : kLeftShoulder;
    pose(2, shoulder) = (side == Side::kRight ? 75.0 : -75.0) * kDegree;
    pose.col(shoulder + 2) = 70.0 * kDegree * Arm(side).hinge;
  }
  BodyState state;
  ForwardJoints(person.body.rest_joints, pose, Eigen::Vector3d::Zero(), state);
  Eigen::Matrix3Xd places(3, person.body.NumMarkers());
  for (int k = 0; k < person.body.NumMarkers(); ++k) {
    places.col(k) = state.WorldFromJoint(person.body.joint[k]) *
                    Eigen::Vector3d(person.usual.segment<3>(3 * k));
  }
  return places;
}

void AddJointPriors(MarkedPerson& person) {
  for (const int joint : person.body.free.Joints()) {
    const int column = person.body.free.Column(joint);
    const JointEase ease = EaseOf(joint);
    const Eigen::Vector3d inverse = (ease.sigma_deg * kDegree).cwiseInverse();
    person.root_information.block<3, 3>(column, column) =
        inverse.asDiagonal() * ease.axes.transpose();
    person.acceleration.segment<3>(column).setConstant(ease.acceleration);
    const bool left = MirrorJoint(joint) > joint;
    const Side side = left ? Side::kLeft : Side::kRight;
    const int right = left ? MirrorJoint(joint) : joint;
    const double sign = left ? -1.0 : 1.0;
    if (right == kRightElbow) {
      const Limb arm = Arm(side);
      person.limits.push_back({column, arm.hinge, 0.0, arm.max_flexion_rad});
    } else if (right == kRightWrist) {
      const WristLimits wrist;
      person.limits.push_back(
          {column, sign * Eigen::Vector3d::UnitZ(), wrist.flexion_min, wrist.flexion_max});
      person.limits.push_back(
          {column, -sign * Eigen::Vector3d::UnitY(), wrist.ulnar_min, wrist.ulnar_max});
    } else if (right == kRightKnee) {
      person.limits.push_back({column, Eigen::Vector3d::UnitX(), 0.0, 150.0 * kDegree});
    } else if (right == kRightHip) {
      person.limits.push_back({column, Eigen::Vector3d::UnitX(), -140.0 * kDegree, 45.0 * kDegree});
      person.limits.push_back({column, Eigen::Vector3d::UnitY(), -60.0 * kDegree, 60.0 * kDegree});
      person.limits.push_back({column, Eigen::Vector3d::UnitZ(), -80.0 * kDegree, 80.0 * kDegree});
    } else if (right == kRightAnkle) {
      person.limits.push_back({column, Eigen::Vector3d::UnitX(), -40.0 * kDegree, 65.0 * kDegree});
      person.limits.push_back({column, Eigen::Vector3d::UnitY(), -35.0 * kDegree, 35.0 * kDegree});
      person.limits.push_back({column, Eigen::Vector3d::UnitZ(), -35.0 * kDegree, 35.0 * kDegree});
    }
  }
}

}  // namespace

std::vector<std::unique_ptr<PoseRest>> MarkedPerson::RestTerms() const {
  std::vector<std::unique_ptr<PoseRest>> terms;
  for (const auto& [column, size] : body.free.Parts()) {
    std::vector<PoseLimit> own;
    for (PoseLimit limit : limits) {
      limit.column -= column;
      if (limit.column >= 0 && limit.column < size) own.push_back(std::move(limit));
    }
    terms.push_back(std::make_unique<PoseRest>(rest.segment(column, size),
                                               root_information.block(column, column, size, size),
                                               std::move(own), kLimitSigma_rad));
  }
  return terms;
}

void MarkedPerson::BlendAt(const Eigen::VectorXd& places) {
  constexpr double kMinShare = 0.05;
  const BodySurface surface(model);
  body.shares.assign(skin.size(), {});
  for (std::size_t k = 0; k < skin.size(); ++k) {
    if (skin[k].ids.empty()) continue;
    Eigen::Index nearest = 0;
    (skin[k].vertices.colwise() - places.segment<3>(3 * static_cast<Eigen::Index>(k)))
        .colwise()
        .squaredNorm()
        .minCoeff(&nearest);
    double sum = 0.0;
    for (const auto& [joint, weight] : surface.Weights(skin[k].ids[nearest])) {
      if (weight < kMinShare) continue;
      body.shares[k].emplace_back(joint, weight);
      sum += weight;
    }
    for (auto& [joint, share] : body.shares[k]) share /= sum;
  }
}

std::vector<int> MarkedPerson::Unmarked() const {
  std::vector<int> joints;
  for (int j = pelvis_marked ? 1 : 0; j < kNumBodyJoints; ++j) {
    if (j == 0 || body.free.Column(j) < 0) joints.push_back(j);
  }
  return joints;
}

std::vector<int> JointOfVertices(const std::shared_ptr<const BodyModel>& model) {
  const BodySurface surface(model);
  std::vector<int> joints(static_cast<std::size_t>(surface.NumVertices()), 0);
  for (int i = 0; i < surface.NumVertices(); ++i) {
    joints[i] = std::ranges::max_element(surface.Weights(i), {}, [](const auto& w) {
                  return w.second;
                })->first;
  }
  return joints;
}

MarkedPerson MakeMarkedPerson(std::shared_ptr<const BodyModel> model, std::vector<MarkerSite> sites,
                              RestPosture posture) {
  MarkedPerson person;
  person.model = model;
  person.sites = std::move(sites);
  person.joint_of_vertex = JointOfVertices(model);
  const BodySurface surface(model);
  SetPlaces(surface, person);

  const std::array<HandModel, 2> models = {HandModel(model, {}, Side::kRight),
                                           HandModel(model, {}, Side::kLeft)};
  const std::array<HandAnatomy, 2> anatomy = {HandAnatomy(models[0]), HandAnatomy(models[1])};
  const std::array<HandAxes, 2> axes = {anatomy[0].axes, anatomy[1].axes};
  const std::array<HandAngles, 2> relaxed = {axes[0].Relaxed(), axes[1].Relaxed()};
  std::array<std::vector<HandNumber>, 2> numbers;
  std::vector<FreePose::Hand> hands;
  for (const int s : {0, 1}) {
    const Side side = s == 0 ? Side::kRight : Side::kLeft;
    std::set<int> marked;
    for (const MarkerSite& site : person.sites) {
      const int finger_joint = site.joint - HandBegin(side);
      if (finger_joint >= 0 && finger_joint < kJointsPerHand) marked.insert(finger_joint / 3);
    }
    if (marked.empty()) continue;
    numbers[s] = HandNumbers(marked);
    FreePose::Hand hand;
    hand.side = side;
    hand.synergies.resize(kHandDofs, static_cast<Eigen::Index>(numbers[s].size()));
    for (std::size_t k = 0; k < numbers[s].size(); ++k) {
      HandAngles unit = HandAngles::Zero();
      for (const auto& part : numbers[s][k].parts) unit(part.row, part.joint) = part.share;
      hand.synergies.col(k) = axes[s].PoseOf(unit);
    }
    hands.push_back(std::move(hand));
  }
  const std::vector<int> free = FreeJoints(person.sites);
  person.body.free = FreePose(RestPose(relaxed, axes, posture, free), free, std::move(hands));
  person.pelvis_marked = std::ranges::any_of(person.sites, [](const MarkerSite& site) {
    return site.joint < kLeftHandBegin &&
           (site.joint == 0 || (site.joint <= kRightFoot && site.joint != kSpine1 &&
                                site.joint != kSpine2 && site.joint != kSpine3));
  });

  person.BlendAt(person.usual);
  person.bent = BentPlaces(person);

  const int n = person.body.free.Size();
  person.rest = person.body.free.Of(person.body.free.Rest());
  person.root_information.setZero(n, n);
  person.acceleration.setConstant(n, 200.0);
  AddJointPriors(person);
  for (const FreePose::Hand& hand : person.body.free.Hands()) {
    const int s = hand.side == Side::kRight ? 0 : 1;
    const auto [mean, root_information] = PriorOf(numbers[s], anatomy[s], relaxed[s]);
    const Eigen::Index m = mean.size();
    person.rest.segment(hand.column, m) = mean;
    person.root_information.block(hand.column, hand.column, m, m) = root_information;
    for (Eigen::Index k = 0; k < m; ++k) {
      const auto& part = numbers[s][k].parts.front();
      const AngleRange range = axes[s].Range(part.row, part.joint);
      const double now = relaxed[s](part.row, part.joint);
      person.limits.push_back({hand.column + static_cast<int>(k), Eigen::VectorXd::Ones(1),
                               range.low - now, range.high - now});
    }
  }
  return person;
}

}  // namespace holdfast
