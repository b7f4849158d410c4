// SPDX-License-Identifier: MIT
#include "solver/reach/reach_person.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "generator/wandr/motion_states.h"
#include "generator/wandr/reach_goals.h"
#include "geometry/body/skeleton.h"
#include "geometry/conventions/posture.h"
#include "geometry/error.h"

namespace holdfast {
namespace {

ReachPerson PersonWith(const ClipBody& body) {
  if (body.model->LoneHand()) {
    throw Error(body.model->Name(), "is a hand alone: it cannot walk", "Give a whole body");
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
  const int wrist = WristJoint(side), elbow = kJointParents[wrist], shoulder = kJointParents[elbow];
  return measures.rest_joints(1, shoulder) - measures.sole_y + bones.offset.col(elbow).norm() +
         bones.offset.col(wrist).norm();
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
    throw Error(source, fmt::format("has frames 0 to {}, and no {}", frames - 1, *frame),
                "Give one of those");
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

}  // namespace holdfast
