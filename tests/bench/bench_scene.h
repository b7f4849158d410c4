// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include <ceres/problem.h>

#include "geometry/embedded.h"
#include "geometry/io/container/npz.h"
#include "geometry/io/mesh/mesh_io.h"
#include "solver/fit/fit.h"
#include "solver/terms/hand/paper_terms.h"
#include "solver/unknowns/rotation_manifold.h"
#include "tests/support/plain_terms.h"

/// The scene that all fit benchmarks share, and the fit as one would first write it for Ceres.
namespace holdfast::bench {

inline constexpr int kFrames = 40;  // the lift and the way to the mouth: wrist and arm both move

/// The embedded demo motion with a 300-vertex mug in the right hand.
struct Scene {
  Scene()
      : model(BodyModel::Default()),
        hand(model, {}, Side::kRight),
        clip(Slice(ReadClip(Archive("clips/demo_drink.npz")), 0, kFrames)) {
    const EmbeddedFile file = FindEmbedded("objects/mug_300.ply");
    object = ReadMeshBytes({reinterpret_cast<const char*>(file.bytes.data()), file.bytes.size()},
                           file.name)
                 .mesh.vertices;
    HandState state(hand);
    state.SetBody(clip.pose[0], clip.trans.col(0));
    state.Evaluate(FingersOf(clip.pose[0], Side::kRight), false);
    // In the palm, where a grasp would put it; the fit does not mind an overlap.
    const Eigen::Vector3d palm = 0.4 * state.WristPosition() + 0.6 * state.JointPositions().col(3);
    first.orientation = Eigen::Quaterniond(state.WristRotation());
    first.translation = palm + state.WristRotation() * Eigen::Vector3d(-0.01, -0.06, 0.0) -
                        state.WristRotation() * object.rowwise().mean();
    fit_object.vertices = object;
  }

  static NpzReader Archive(const char* name) { return {FindEmbedded(name).bytes, name}; }

  std::unique_ptr<FrameFitter> Fitter(const FitOptions& options) const {
    const HandModel* const hands[] = {&hand};
    auto fitter = std::make_unique<FrameFitter>(hands, fit_object, options.OnlyPaper(), 0.0);
    fitter->Place(first);
    fitter->TakeHold(Side::kRight, clip.pose[0], clip.trans.col(0),
                     FingersOf(clip.pose[0], Side::kRight));
    return fitter;
  }

  std::shared_ptr<const BodyModel> model;
  HandModel hand;
  Clip clip;
  Eigen::Matrix3Xd object;
  FitObject fit_object;
  ObjectPose first;
};

inline const Scene& TheScene() {
  static const Scene scene;
  return scene;
}

/// Weights that let every term count: with the paper's, E_c and E_t hardly move the optimum.
inline FitOptions Options(PairPrecision precision) {
  FitOptions options;
  options.lambda_contact = 1.0;
  options.lambda_temporal = 0.1;
  options.precision = precision;
  return options;
}

/// Frame by frame with every pair a residual; the same start, terms, weights and tolerances.
class PlainFitter {
 public:
  PlainFitter(const Scene& scene, const FitOptions& options)
      : scene_(scene),
        options_(options),
        state_(scene.hand),
        contact_state_(scene.hand),
        object_(scene.first),
        fingers_(FingersOf(scene.clip.pose[0], Side::kRight)) {
    state_.SetBody(scene.clip.pose[0], scene.clip.trans.col(0));
    state_.Evaluate(fingers_, false);
    wrist_ = {state_.WristRotation(), state_.WristPosition()};
    reference_ = HandObjectDistance::Distances(
        InObjectFrame(state_.Vertices(), object_.orientation, object_.translation), scene.object);
  }

  double Solve(int frame) {  // the energy reached
    using testing::PlainPairs;
    state_.SetBody(scene_.clip.pose[frame], scene_.clip.trans.col(frame));
    contact_state_.SetBody(scene_.clip.pose[frame], scene_.clip.trans.col(frame));
    const ObjectPose previous = object_;
    const FingerPose previous_fingers = fingers_;
    const WristFrame wrist{state_.WristRotation(), state_.WristPosition()};
    object_ = FollowWrist(previous, wrist_, wrist);
    wrist_ = wrist;

    ceres::Problem problem;
    double* q = object_.orientation.coeffs().data();
    double* t = object_.translation.data();
    double* p = fingers_.data();
    problem.AddParameterBlock(q, 4, new RotationManifold);
    problem.AddResidualBlock(new PlainPairs(PlainPairs::Kind::kDistance, &state_, scene_.object,
                                            reference_, 0.0, options_.lambda_distance),
                             nullptr, q, t, p);
    problem.AddResidualBlock(
        new PlainPairs(PlainPairs::Kind::kContact, &contact_state_, scene_.object, reference_,
                       options_.contact_threshold_m, options_.lambda_contact),
        nullptr, q, t, p);
    problem.AddResidualBlock(new Temporal(previous.orientation, previous.translation,
                                          previous_fingers, options_.lambda_temporal),
                             nullptr, q, t, p);
    ceres::Solver::Options solver_options = FrameSolverOptions(options_);
    solver_options.num_threads = 2;
    ceres::Solver::Summary summary;
    ceres::Solve(solver_options, &problem, &summary);
    return 2.0 * summary.final_cost;
  }

 private:
  const Scene& scene_;
  FitOptions options_;
  HandState state_;
  HandState contact_state_;  // its own: Ceres evaluates both blocks at a time
  ObjectPose object_;
  FingerPose fingers_;
  WristFrame wrist_;
  Eigen::MatrixXd reference_;
};

}  // namespace holdfast::bench
