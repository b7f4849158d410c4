// SPDX-License-Identifier: MIT
#include "solver/actions/action_studio.h"

#include <algorithm>
#include <limits>

#include "generator/actions/action_script.h"
#include "geometry/body/skeleton.h"
#include "geometry/score/contact_metrics.h"
#include "solver/body_ik/arm_ik.h"
#include "solver/handover/grasp_transfer.h"

namespace holdfast {
namespace {

using Eigen::Vector3d;

constexpr double kHeadCell_m = 0.005, kTrunkCell_m = 0.016;
constexpr int kSamples = 260;
constexpr int kSkinEvery = 6;

DistanceGrid GridOf(const TriangleMesh& mesh, double cell_m) {
  DistanceGridOptions options;
  options.cell_m = cell_m;
  options.padding_m = 0.01;
  return DistanceGrid(SignedDistance(mesh), options);
}

double WeightOn(const BodySurface& body, int vertex, auto&& wanted) {
  double sum = 0.0;
  for (const auto& [joint, weight] : body.Weights(vertex)) sum += wanted(joint) ? weight : 0.0;
  return sum;
}

bool IsForearmOrHand(int joint) { return (joint >= 18 && joint <= 21) || joint >= kLeftHandBegin; }

std::vector<int> VerticesWhere(const BodySurface& body, int every, auto&& wanted) {
  std::vector<int> ids;
  int count = 0;
  for (int i = 0; i < body.NumVertices(); ++i) {
    if (wanted(i) && count++ % every == 0) ids.push_back(i);
  }
  return ids;
}

// Skin of the trunk, closed at neck, shoulders and hips, relative to spine3.
TriangleMesh TrunkOf(const BodySurface& body) {
  const auto in_trunk = [](int joint) {
    return joint == 0 || joint == 3 || joint == 6 || joint == 9 || joint == 13 || joint == 14;
  };
  std::vector<int> place(static_cast<std::size_t>(body.NumVertices()), -1);
  std::vector<int> ids =
      VerticesWhere(body, 1, [&](int i) { return WeightOn(body, i, in_trunk) > 0.6; });
  TriangleMesh trunk;
  trunk.vertices.resize(3, static_cast<Eigen::Index>(ids.size()));
  for (std::size_t k = 0; k < ids.size(); ++k) {
    place[ids[k]] = static_cast<int>(k);
    trunk.vertices.col(k) = body.RestVertices().col(ids[k]) - body.RestJoints().col(kSpine3);
  }
  std::vector<Eigen::Vector3i> faces;
  for (Eigen::Index f = 0; f < body.Faces().cols(); ++f) {
    Eigen::Vector3i face;
    for (int c = 0; c < 3; ++c) face(c) = place[body.Faces()(c, f)];
    if ((face.array() >= 0).all()) faces.push_back(face);
  }
  trunk.faces.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (std::size_t f = 0; f < faces.size(); ++f) {
    trunk.faces.col(f) = faces[f];
  }
  return CloseHoles(trunk);
}

}  // namespace

ActionActor::ActionActor(std::shared_ptr<const BodyModel> model, const Eigen::VectorXd& betas)
    : model_(model),
      betas_(betas),
      measures_(MeasureBody(*model, betas)),
      surface_(model, betas),
      face_(FindFaceMarks(surface_)),
      head_(GridOf(face_.head, kHeadCell_m)),
      trunk_(GridOf(TrunkOf(surface_), kTrunkCell_m)),
      right_(model, betas, Side::kRight),
      left_(model, betas, Side::kLeft),
      skin_(model, betas,
            VerticesWhere(surface_, 2,
                          [&](int i) { return WeightOn(surface_, i, IsForearmOrHand) < 0.3; })),
      forearms_(model, betas,
                VerticesWhere(surface_, 3,
                              [&](int i) {
                                return WeightOn(surface_, i, [](int joint) {
                                         return joint >= 18 && joint <= 21;
                                       }) > 0.7;
                              })),
      right_arm_(measures_.rest_joints, Side::kRight),
      left_arm_(measures_.rest_joints, Side::kLeft) {}

ActionProp MakeActionProp(std::string name, const TriangleMesh& mesh,
                          const TriangleMesh& simplified, bool mirrored, int threads) {
  const TriangleMesh shown = mirrored ? ReflectX(mesh) : mesh;
  SignedDistance surface(shown);
  FitObject fit =
      MakeFitObject(shown, surface, mirrored ? ReflectX(simplified) : simplified, threads);
  ObjectMarks marks = MarksOf(name, mesh);
  if (mirrored) marks = ReflectX(marks);
  const Eigen::Index every = std::max<Eigen::Index>(1, fit.surface.cols() / kSamples);
  Eigen::Matrix3Xd samples = fit.surface(Eigen::all, Eigen::seq(0, Eigen::last, every));
  return {std::move(name), shown, std::move(surface), std::move(fit), marks, std::move(samples)};
}

ActionGrasps::ActionGrasps(const ActionActor& actor, const std::vector<Grasp>& right,
                           const std::vector<std::pair<Grasp, Grasp>>& pairs) {
  const auto skin = [&](const Grasp& grasp) {
    return SkinInWrist(actor.Hand(Side::kRight), grasp.fingers, kSkinEvery);
  };
  for (const Grasp& grasp : right) single.push_back({grasp, std::nullopt, skin(grasp)});
  for (const auto& [giving, taking] : pairs) paired.push_back({giving, taking, skin(giving)});
}

namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;

constexpr double kComfortable = 25.0;  // sum of both arms' discomfort
constexpr int kTurns = 36;

Matrix3d FacingFront() { return (Matrix3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished(); }

// Pose of the other side's wrist, mirrored at the body's midplane.
Isometry3d Mirrored(const Isometry3d& wrist) {
  const Vector3d flip(-1.0, 1.0, 1.0);
  return RigidTransform(flip.asDiagonal() * wrist.linear() * flip.asDiagonal(),
                        flip.cwiseProduct(wrist.translation()));
}

}  // namespace

std::vector<std::pair<Grasp, Grasp>> FindGraspPairs(const HandModel& right_hand,
                                                    const HandModel& left_hand,
                                                    const ActionProp& prop,
                                                    const std::vector<Grasp>& right,
                                                    std::uint64_t seed, int tries) {
  // An upright person facing -y who holds an object in front of the chest.
  const Eigen::Matrix3Xd& rest_joints = right_hand.Surface().RestJoints();
  const ArmIk right_arm(rest_joints, Side::kRight), left_arm(rest_joints, Side::kLeft);
  const auto shoulder = [&](const ArmIk& arm) -> Vector3d {
    return FacingFront() * (rest_joints.col(arm.Bones().root) - rest_joints.col(0));
  };
  const Vector3d middle =
      0.5 * (prop.mesh.vertices.rowwise().minCoeff() + prop.mesh.vertices.rowwise().maxCoeff());
  const Vector3d place =
      shoulder(right_arm) + Vector3d(-shoulder(right_arm).x(), -0.6 * right_arm.Length(), -0.2);
  const std::vector<Isometry3d> poses = UprightPoses(middle, place, kTurns, {0.4});
  const auto cost_of = [&](const ArmIk& arm, const Isometry3d& object, const Grasp& grasp) {
    const ArmChoice choice =
        arm.Best({shoulder(arm), FacingFront(), object * grasp.wrist_from_object.inverse()});
    return choice.discomfort + 50.0 * choice.shortfall_m;
  };
  struct Offered {
    double cost;
    std::size_t grasp;
    Isometry3d object;
  };
  std::vector<Offered> offered;
  for (std::size_t g = 0; g < right.size(); ++g) {
    Offered best{std::numeric_limits<double>::infinity(), g, Isometry3d::Identity()};
    for (const Isometry3d& pose : poses) {
      const double cost = cost_of(right_arm, pose, right[g]);
      if (cost < best.cost) best = {cost, g, pose};
    }
    offered.push_back(best);
  }
  std::ranges::stable_sort(offered, {}, &Offered::cost);
  if (static_cast<int>(offered.size()) > tries) offered.resize(static_cast<std::size_t>(tries));

  std::vector<std::pair<Grasp, Grasp>> pairs;
  GraspTransferOptions options;
  options.seed = seed;
  options.closings = 12;
  for (const Offered& offer : offered) {
    const Grasp& giving = right[offer.grasp];
    const Isometry3d wrist = offer.object * giving.wrist_from_object.inverse();
    const GraspTransfer transfer =
        TransferGrasp(right_hand, giving.fingers, giving.wrist_from_object, left_hand,
                      Mirrored(wrist).inverse() * offer.object, prop.mesh, prop.surface,
                      *prop.fit.distance, options);
    if (!transfer.found) continue;
    double least = std::numeric_limits<double>::infinity();
    for (const Isometry3d& pose : poses) {
      least = std::min(least,
                       cost_of(right_arm, pose, giving) + cost_of(left_arm, pose, transfer.grasp));
    }
    if (least < kComfortable) pairs.emplace_back(giving, transfer.grasp);
  }
  return pairs;
}

}  // namespace holdfast
