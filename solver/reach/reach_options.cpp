// SPDX-License-Identifier: MIT
#include "solver/reach/reach_options.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "generator/wandr/motion_states.h"
#include "generator/wandr/reach_goals.h"
#include "geometry/body/skeleton.h"
#include "geometry/conventions/posture.h"
#include "geometry/error.h"
#include "geometry/mesh/signed_distance.h"

namespace holdfast {
namespace {

ReachPerson PersonWith(const ClipBody& body) {
  if (body.model->LoneHand()) {
    throw Error(body.model->Name(), "is a hand model and cannot walk", "Give a full-body model");
  }
  ReachPerson person;
  person.body = body.model;
  person.betas = body.betas;
  person.measures = MeasureBody(*body.model, body.betas);
  person.bones = wandr::BoneOffsetsOf(person.measures.rest_joints);
  return person;
}

}  // namespace

Eigen::Vector3d ReachPerson::Pelvis() const {
  return states.rightCols<1>().head<3>() + bones.offset.col(0);
}

double ReachPerson::HighestReach(Side side) const {
  constexpr double kShoulderRaised = 30.0 * kDegree;
  const int wrist = WristJoint(side), elbow = kJointParents[wrist], shoulder = kJointParents[elbow];
  return measures.rest_joints(1, shoulder) - measures.sole_y +
         std::sin(kShoulderRaised) * bones.offset.col(shoulder).norm() +
         bones.offset.col(elbow).norm() + bones.offset.col(wrist).norm();
}

ReachPerson StandingPerson(std::shared_ptr<const BodyModel> body) {
  ReachPerson person = PersonWith({std::move(body), {}});
  person.like.body_model = person.body->Name();
  person.states = wandr::StateOf(wandr::StandingPose(person.measures));
  return person;
}

ReachPerson PersonInClip(Clip clip, const ClipBody& body, std::optional<int> frame,
                         const std::string& source) {
  const int frames = clip.NumFrames();
  if (frame && (*frame < 0 || *frame >= frames)) {
    throw Error(source, fmt::format("has frames 0 to {}, but no frame {}", frames - 1, *frame),
                "Give a frame in this range");
  }
  ReachPerson person = PersonWith(body);
  RequireMeters(source, clip, *body.model);
  person.states = wandr::StatesOfClip(clip);
  const double rate = wandr::kFramesPerSecond / clip.frame_rate;
  const int last = std::min(static_cast<int>(std::lround(frame.value_or(frames - 1) * rate)),
                            static_cast<int>(person.states.cols()) - 1);
  person.states.conservativeResize(Eigen::NoChange, last + 1);
  person.like = std::move(clip);
  return person;
}

BodyMeasures MirroredMeasures(const BodyMeasures& measures) {
  BodyMeasures mirrored = measures;
  for (Eigen::Index k = 0; k < measures.rest_joints.cols(); ++k) {
    mirrored.rest_joints.col(k) =
        wandr::MirroredPoint(measures.rest_joints.col(MirrorJoint(static_cast<int>(k))));
  }
  return mirrored;
}

std::string_view ReachMethodName(ReachBy by) {
  return by == ReachBy::kIntention ? "intention"
         : by == ReachBy::kLatents ? "latent-opt"
                                   : "vae-opt";
}

OptionTable OptionsOf(ReachJob& job) {
  ReachOptions& options = job.options;
  OptionTable table;
  table.Choice("wrist", options.side, {{"right", Side::kRight}, {"left", Side::kLeft}},
               "Wrist used for reaching; the left wrist is solved by mirroring the person");
  table.Number(
      "time", "s", options.time_s, {0.1, 60.0},
      "computed from turning angle and walking distance; vae-opt: 1.4 + distance / (0.95 m/s)",
      "Seconds until each goal is due");
  table.Choice<std::optional<ReachBy>>(
      "method", job.method,
      {{"auto", std::nullopt},
       {"intention", ReachBy::kIntention},
       {"latent-opt", ReachBy::kLatents},
       {"vae-opt", ReachBy::kVaeOpt}},
      "intention: condition the network on the goal and run it once. latent-opt: start as with "
      "intention, optimize the latents until the wrist reaches the goal and stays there and the "
      "motion is plausible, and pin the feet. vae-opt: WANDR's baseline, for comparison. auto: "
      "intention, or latent-opt if an object is taken");
  table.Choice<std::optional<VaeOptMethod>>(
      "optimizer", job.optimizer,
      {{"auto", std::nullopt},
       {"lm", VaeOptMethod::kLm},
       {"lbfgs", VaeOptMethod::kLbfgs},
       {"lbfgs-step1", VaeOptMethod::kLbfgsStepOne},
       {"adam", VaeOptMethod::kAdam}},
      "Optimizer of vae-opt: lm (auto): Levenberg-Marquardt on the goal residuals and the prior; "
      "lbfgs: with line search; lbfgs-step1: full steps, as in WANDR's released preset; adam: with "
      "the schedule of WANDR's released code");
  table.Number("iterations", "", job.iterations, {1, 100'000}, "lm 40, lbfgs-step1 80, others 200",
               "vae-opt: maximum number of iterations");
  table.Number("prior_weight", "", job.prior_weight, {0.0, 1e6}, "1e-6",
               "vae-opt: prior weight lambda in 1/2 |wrist - goal|^2 (meters) + lambda/2 |z|^2");
  table.Number("samples", "", options.samples, {1, 10'000}, "16, or 4 if each is optimized",
               "Number of motions to sample; the best is kept");
  table.Flag("free_time", options.free_time,
             "Let the wrist arrive at any time up to 1 s after the goal is due (latent-opt)");
  table.Flag(
      "refit", options.refit,
      "Refit the result (feet pinned, wrist on the goal). Without this step, the motion ends some "
      "centimeters from the goal (latent-opt: millimeters)");
  table.Flag("refit_all", options.refit_all, "Refit all motions, not only the best");
  AddStyleOption(table, "grasp", job.grasp,
                 "Grasp style for taking the object: power, precision, handle, or auto (the best)");
  table.Number("object_yaw", "deg", job.object_yaw_deg, {-360.0, 360.0}, "chosen for the hand",
               "Yaw of the standing object, degrees");
  table.Number("object_scale", "", job.object_scale, kPositive,
               "Multiplies the object's coordinates (0.001 for millimeters)");
  table.Number("sigma", "", options.sigma, {0.0, 3.0},
               "Standard deviation of the latents; 0: the mean motion");
  return table;
}

ReachOptions ReachOptionsOf(const ReachJob& job, bool takes) {
  ReachOptions options = job.options;
  options.by = job.method.value_or(takes ? ReachBy::kLatents : ReachBy::kIntention);
  const std::string unseen =
      fmt::format("cannot be used with --method {}", ReachMethodName(options.by));
  if (options.by == ReachBy::kVaeOpt) {
    options.vae.method = job.optimizer.value_or(VaeOptMethod::kLm);
    options.vae.iterations = job.iterations.value_or(0);
    options.vae.prior_weight = job.prior_weight.value_or(options.vae.prior_weight);
  } else if (job.optimizer || job.iterations || job.prior_weight) {
    throw Error("--optimizer, --iterations, --prior-weight", unseen, "Add --method vae-opt");
  }
  if (!options.obstacles.empty() && options.by != ReachBy::kLatents) {
    throw Error("--obstacle", unseen, "Add --method latent-opt");
  }
  if (job.approach) {
    if (job.approach->norm() < 1e-6) {
      throw Error("--approach", "has no direction", "Give a vector other than 0,0,0");
    }
    options.approach = job.approach->normalized();
  }
  return options;
}

double ReachObstacle::Distance(const Eigen::Vector3d& point, Side side) const {
  return distance->Distance(side == Side::kLeft ? wandr::MirroredPoint(point) : point);
}

ReachObstacle MakeObstacle(std::string name, TriangleMesh mesh, Side side, int threads) {
  ReachObstacle obstacle{std::move(name), std::move(mesh), nullptr};
  TriangleMesh seen = obstacle.mesh;
  if (side == Side::kLeft) {
    seen.vertices.row(0) *= -1.0;
    seen.faces.row(1).swap(seen.faces.row(2));
  }
  DistanceGridOptions grid;
  grid.cell_m = 0.02;
  grid.padding_m = 0.3;
  grid.threads = threads;
  obstacle.distance = std::make_shared<DistanceGrid>(SignedDistance(seen), grid);
  return obstacle;
}

}  // namespace holdfast
