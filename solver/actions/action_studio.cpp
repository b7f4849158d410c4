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
    place[static_cast<std::size_t>(ids[k])] = static_cast<int>(k);
    trunk.vertices.col(static_cast<Eigen::Index>(k)) =
        body.RestVertices().col(ids[k]) - body.RestJoints().col(kSpine3);
  }
  std::vector<Eigen::Vector3i> faces;
  for (Eigen::Index f = 0; f < body.Faces().cols(); ++f) {
    Eigen::Vector3i face;
    for (int c = 0; c < 3; ++c) face(c) = place[static_cast<std::size_t>(body.Faces()(c, f))];
    if ((face.array() >= 0).all()) faces.push_back(face);
  }
  trunk.faces.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (std::size_t f = 0; f < faces.size(); ++f) {
    trunk.faces.col(static_cast<Eigen::Index>(f)) = faces[f];
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
      person_{ArmIk(measures_.rest_joints, Side::kRight), ArmIk(measures_.rest_joints, Side::kLeft),
              head_} {}

ActionProp MakeActionProp(std::string name, const TriangleMesh& mesh,
                          const TriangleMesh& simplified, bool mirrored, int threads) {
  const TriangleMesh shown = mirrored ? ReflectX(mesh) : mesh;
  SignedDistance surface(shown);
  FitObject fit =
      MakeFitObject(shown, surface, mirrored ? ReflectX(simplified) : simplified, threads);
  ObjectMarks marks = MarksOf(name, mesh);
  if (mirrored) marks = ReflectX(marks);
  const Eigen::Index every = std::max<Eigen::Index>(1, fit.surface.cols() / kSamples);
  Eigen::Matrix3Xd samples(3, (fit.surface.cols() + every - 1) / every);
  for (Eigen::Index i = 0; i < samples.cols(); ++i) samples.col(i) = fit.surface.col(i * every);
  return {std::move(name), shown, std::move(surface), std::move(fit), marks, std::move(samples)};
}

ActionGrasps::ActionGrasps(const ActionActor& actor, std::vector<Grasp> right,
                           std::vector<GraspPair> pairs)
    : right_(std::move(right)), pairs_(std::move(pairs)) {
  const auto skin = [&](Side side, const Grasp& grasp) {
    return SkinInWrist(actor.Hand(side), grasp.fingers, kSkinEvery);
  };
  for (const Grasp& grasp : right_) {
    single_.push_back({&grasp, nullptr, skin(Side::kRight, grasp), Eigen::Matrix3Xd()});
  }
  for (const GraspPair& pair : pairs_) {
    paired_.push_back(
        {&pair.right, &pair.left, skin(Side::kRight, pair.right), skin(Side::kLeft, pair.left)});
  }
}

namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kComfortable = 25.0;  // sum of both arms' discomfort
constexpr int kTurns = 36;

Matrix3d FacingFront() { return (Matrix3d() << 1, 0, 0, 0, 0, -1, 0, 1, 0).finished(); }

// An upright person facing -y who holds an object in front of the chest.
class Meeting {
 public:
  Meeting(const Eigen::Matrix3Xd& rest_joints, const TriangleMesh& mesh)
      : rest_joints_(rest_joints),
        right_(rest_joints, Side::kRight),
        left_(rest_joints, Side::kLeft) {
    const Vector3d middle =
        0.5 * (mesh.vertices.rowwise().minCoeff() + mesh.vertices.rowwise().maxCoeff());
    const Vector3d place =
        Shoulder(right_) + Vector3d(-Shoulder(right_).x(), -0.6 * right_.Length(), -0.2);
    poses_ = UprightPoses(middle, place, kTurns, {0.4});
  }

  const std::vector<Isometry3d>& Poses() const { return poses_; }
  double Cost(Side side, const Isometry3d& object, const Grasp& grasp) const {
    const ArmIk& arm = side == Side::kRight ? right_ : left_;
    const ArmChoice choice =
        arm.Best({Shoulder(arm), FacingFront(), object * grasp.wrist_from_object.inverse()});
    return choice.discomfort + 50.0 * choice.shortfall_m;
  }

 private:
  Vector3d Shoulder(const ArmIk& arm) const {
    return FacingFront() * (rest_joints_.col(arm.Bones().root) - rest_joints_.col(0));
  }

  const Eigen::Matrix3Xd& rest_joints_;
  ArmIk right_, left_;
  std::vector<Isometry3d> poses_;
};

// Pose of the other side's wrist, mirrored at the body's midplane.
Isometry3d Mirrored(const Isometry3d& wrist) {
  const Vector3d flip(-1.0, 1.0, 1.0);
  return RigidTransform(flip.asDiagonal() * wrist.linear() * flip.asDiagonal(),
                        flip.cwiseProduct(wrist.translation()));
}

}  // namespace

std::vector<GraspPair> FindGraspPairs(const HandModel& right_hand, const HandModel& left_hand,
                                      const ActionObject& object, const std::vector<Grasp>& right,
                                      std::uint64_t seed, int tries) {
  const Meeting meeting(right_hand.Surface().RestJoints(), object.mesh);
  struct Offered {
    double cost;
    std::size_t grasp;
    Isometry3d object;
  };
  std::vector<Offered> offered;
  for (std::size_t g = 0; g < right.size(); ++g) {
    Offered best{std::numeric_limits<double>::infinity(), g, Isometry3d::Identity()};
    for (const Isometry3d& pose : meeting.Poses()) {
      const double cost = meeting.Cost(Side::kRight, pose, right[g]);
      if (cost < best.cost) best = {cost, g, pose};
    }
    offered.push_back(best);
  }
  std::ranges::stable_sort(offered, {}, &Offered::cost);
  if (static_cast<int>(offered.size()) > tries) offered.resize(static_cast<std::size_t>(tries));

  std::vector<GraspPair> pairs;
  GraspTransferOptions options;
  options.seed = seed;
  options.closings = 12;
  for (const Offered& offer : offered) {
    const Grasp& giving = right[offer.grasp];
    const Isometry3d wrist = offer.object * giving.wrist_from_object.inverse();
    const GraspTransfer transfer =
        TransferGrasp(right_hand, giving.fingers, giving.wrist_from_object, left_hand,
                      Mirrored(wrist).inverse() * offer.object, object.mesh, object.surface,
                      object.distance, options);
    if (!transfer.found) continue;
    double least = std::numeric_limits<double>::infinity();
    for (const Isometry3d& pose : meeting.Poses()) {
      least = std::min(least, meeting.Cost(Side::kRight, pose, giving) +
                                  meeting.Cost(Side::kLeft, pose, transfer.grasp));
    }
    if (least < kComfortable) pairs.push_back({giving, transfer.grasp});
  }
  return pairs;
}

}  // namespace holdfast
