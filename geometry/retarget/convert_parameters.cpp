// SPDX-License-Identifier: MIT
#include "geometry/retarget/convert_parameters.h"

#include <algorithm>
#include <array>
#include <tuple>

#include <fmt/format.h>
#include <Eigen/Cholesky>

#include "geometry/body/hand_model.h"
#include "geometry/error.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

bool SameSurface(const BodyModel& a, const BodyModel& b) {
  return a.NumVertices() == b.NumVertices() && a.Faces().cols() == b.Faces().cols() &&
         a.Faces() == b.Faces();
}

// Positions of joints, and optionally vertices, relative to the first joint, as functions of betas.
Eigen::VectorXd RelativeRest(const BodyModel& model, const Eigen::VectorXd& betas,
                             const std::vector<int>& joints, bool with_vertices) {
  const Eigen::Matrix3Xd shaped = model.ShapedVertices(betas);
  const Eigen::Matrix3Xd rest = model.RestJoints(shaped);
  const Eigen::Index vertices = with_vertices ? shaped.cols() : 0;
  Eigen::Matrix3Xd places(3, static_cast<Eigen::Index>(joints.size()) + vertices);
  const Eigen::Vector3d origin = rest.col(joints.front());
  for (std::size_t k = 0; k < joints.size(); ++k) {
    places.col(static_cast<Eigen::Index>(k)) = rest.col(joints[k]) - origin;
  }
  if (with_vertices) places.rightCols(vertices) = shaped.colwise() - origin;
  return places.reshaped();
}

Eigen::VectorXd SolveBetas(const BodyModel& from, const Eigen::VectorXd& betas, const BodyModel& to,
                           const std::vector<int>& joints, bool same_surface, int num_betas) {
  // Cost of a unit coefficient, in meters of joint position: keeps coefficients at zero that do not
  // affect the joints.
  constexpr double kBetaRidge_m = 1e-5;
  const int count = std::min(num_betas, to.NumShape());
  if (count <= 0 || to.IsSubject()) return {};
  const Eigen::VectorXd target = RelativeRest(from, betas, joints, same_surface);
  const Eigen::VectorXd mean = RelativeRest(to, {}, joints, same_surface);
  Eigen::MatrixXd directions(mean.size(), count);
  for (int k = 0; k < count; ++k) {
    directions.col(k) =
        RelativeRest(to, Eigen::VectorXd::Unit(count, k), joints, same_surface) - mean;
  }
  Eigen::MatrixXd normal = directions.transpose() * directions;
  normal.diagonal().array() += kBetaRidge_m * kBetaRidge_m;
  return normal.ldlt().solve(directions.transpose() * (target - mean));
}

bool AnyTurns(const Clip& clip, int begin, int count) {
  return std::ranges::any_of(
      clip.pose, [&](const JointPose& pose) { return !pose.middleCols(begin, count).isZero(0.0); });
}

// Lists what moves in the clip but has no joint in the target.
std::vector<std::string> Lost(const Clip& clip, const BodyModel& from, const BodyModel& to) {
  constexpr std::array<std::tuple<const char*, int, int>, 5> kGroups = {
      {{"the body's motion", 1, 21},
       {"pose_jaw", 22, 1},
       {"pose_eye", 23, 2},
       {"the left fingers", kLeftHandBegin, kJointsPerHand},
       {"the right fingers", kRightHandBegin, kJointsPerHand}}};
  const std::vector<int>& kept = LayoutOf(to.Kind()).joint_of_native;
  std::vector<std::string> lost;
  for (const auto& [name, begin, count] : kGroups) {
    // A hand-only model has a wrist, but the joints that moved it are gone.
    const bool has = std::ranges::find(kept, begin) != kept.end();
    if (!has && AnyTurns(clip, begin, count)) lost.emplace_back(name);
  }
  if (clip.v_template.cols() > 0 && !SameSurface(from, to)) {
    lost.push_back(fmt::format("v_template: the subject's surface has {} vertices, {} has {}",
                               clip.v_template.cols(), to.Name(), to.NumVertices()));
  }
  if (clip.contact && clip.contact->body.size() > 0 && !SameSurface(from, to)) {
    lost.emplace_back("contact_body: its labels belong to the other model's vertices");
  }
  return lost;
}

void RequireConvertible(const BodyModel& from, const BodyModel& to) {
  if (!from.LoneHand()) return;
  if (!to.LoneHand()) {
    throw Error(from.Name(),
                fmt::format("is a hand alone, which does not move the body {}", to.Name()),
                "Give the motion of the whole body with --onto CLIP");
  }
  if (*from.LoneHand() != *to.LoneHand()) {
    throw Error(from.Name(),
                fmt::format("is a {} hand, but {} is a {} hand", SideName(*from.LoneHand()),
                            to.Name(), SideName(*to.LoneHand())),
                "Give the model of the same side");
  }
}

}  // namespace

std::vector<int> CommonJoints(const BodyModel& a, const BodyModel& b) {
  std::vector<int> common;
  std::ranges::set_intersection(LayoutOf(a.Kind()).joint_of_native,
                                LayoutOf(b.Kind()).joint_of_native, std::back_inserter(common));
  return common;
}

std::vector<JointResidual> CompareJoints(const Clip& a, const Eigen::Matrix3Xd& rest_joints_a,
                                         const Clip& b, const Eigen::Matrix3Xd& rest_joints_b,
                                         const std::vector<int>& joints) {
  std::vector<JointResidual> residuals;
  for (const int joint : joints) residuals.push_back({joint, 0.0, 0.0});
  BodyState state_a, state_b;
  for (int t = 0; t < a.NumFrames(); ++t) {
    const auto frame = static_cast<std::size_t>(t);
    ForwardJoints(rest_joints_a, a.pose[frame], a.trans.col(t), state_a);
    ForwardJoints(rest_joints_b, b.pose[frame], b.trans.col(t), state_b);
    for (JointResidual& residual : residuals) {
      const double mm =
          1e3 * (state_a.joints.col(residual.joint) - state_b.joints.col(residual.joint)).norm();
      residual.mean_mm += mm / a.NumFrames();
      residual.max_mm = std::max(residual.max_mm, mm);
    }
  }
  return residuals;
}

ConvertedClip ConvertClip(const Clip& clip, std::shared_ptr<const BodyModel> from,
                          const Eigen::VectorXd& betas, std::shared_ptr<const BodyModel> to,
                          int num_betas) {
  RequireConvertible(*from, *to);
  const std::vector<int> joints = CommonJoints(*from, *to);
  ConvertedClip result;
  const bool same_surface = SameSurface(*from, *to);  // the same triangles
  result.lost = Lost(clip, *from, *to);

  Clip& out = result.clip;
  out = clip;
  if (!same_surface) {
    out.v_template.resize(3, 0);
    if (out.contact) out.contact->body.resize(0, 0);
  } else if (from->IsSubject() && out.v_template.cols() == to->NumVertices()) {
    to = BodyModel::WithTemplate(std::move(to), out.v_template);
  }
  out.betas =
      to->IsSubject() ? clip.betas : SolveBetas(*from, betas, *to, joints, same_surface, num_betas);
  out.body_model = to->Name();
  const std::optional<Side> hand = to->LoneHand();
  out.surface_model_type = hand ? "mano" : to->Kind() == ModelKind::kSmplh ? "smplh" : "smplx";

  const Eigen::VectorXd to_betas = to->IsSubject() ? Eigen::VectorXd() : out.betas;
  const Eigen::Matrix3Xd rest_from = from->RestJoints(from->ShapedVertices(betas));
  const Eigen::Matrix3Xd rest_to = to->RestJoints(to->ShapedVertices(to_betas));
  const bool cut_off = hand && !from->LoneHand();
  BodyState state;
  for (int t = 0; t < out.NumFrames(); ++t) {
    JointPose& pose = out.pose[static_cast<std::size_t>(t)];
    if (cut_off) {
      ForwardJoints(rest_from, pose, clip.trans.col(t), state);
      const int wrist = WristJoint(*hand);
      out.trans.col(t) = state.joints.col(wrist) - rest_to.col(wrist);
      const FingerPose fingers = FingersOf(pose, *hand);
      pose.setZero();
      pose.col(0) = LogSO3(state.world_rotation[static_cast<std::size_t>(wrist)]);
      if (t > 0) {
        pose.col(0) =
            UnwrapAxisAngle(pose.col(0), out.pose[static_cast<std::size_t>(t - 1)].col(0));
      }
      SetFingers(pose, *hand, fingers);
    } else {
      out.trans.col(t) = clip.trans.col(t) + rest_from.col(0) - rest_to.col(0);
      if (to->Kind() == ModelKind::kSmplh) pose.middleCols<3>(22).setZero();
    }
  }
  if (hand && !out.holding_hand.empty()) {
    for (std::uint8_t& bits : out.holding_hand) bits &= HoldingBit(*hand);
  }

  result.joints = CompareJoints(clip, rest_from, out, rest_to, joints);
  for (const JointResidual& residual : result.joints) {
    result.mean_mm += residual.mean_mm / static_cast<double>(result.joints.size());
    result.max_mm = std::max(result.max_mm, residual.max_mm);
  }
  if (same_surface) {
    const BodySurface surface_from(from, betas), surface_to(to, to_betas);
    BodyState other;
    double sum = 0.0, worst = 0.0;
    for (int t = 0; t < out.NumFrames(); ++t) {
      Forward(surface_from, clip.pose[static_cast<std::size_t>(t)], clip.trans.col(t), state);
      Forward(surface_to, out.pose[static_cast<std::size_t>(t)], out.trans.col(t), other);
      const auto mm = (1e3 * (state.vertices - other.vertices).colwise().norm()).eval();
      sum += mm.mean() / out.NumFrames();
      worst = std::max(worst, mm.maxCoeff());
    }
    result.vertex_mean_mm = sum;
    result.vertex_max_mm = worst;
  }
  return result;
}

}  // namespace holdfast
