// SPDX-License-Identifier: MIT
#include "solver/synthesis_motion.h"

#include <vector>

#include "generator/matching/body_frame.h"
#include "generator/matching/foot_lock.h"
#include "generator/matching/sole_contact.h"
#include "geometry/resample.h"
#include "geometry/rotation.h"

namespace holdfast {

Clip MotionOfKeyFrames(const Clip& keys, const BodyMeasures& measures, double frame_rate) {
  Clip clip = ResampleSmoothly(keys, frame_rate);
  const Eigen::Matrix3Xd& rest_joints = measures.rest_joints;
  std::vector<BodyFrame> frames = BodyFrames(clip, rest_joints);
  const SolePoints soles(rest_joints, measures.sole_y);
  std::vector<Soles> points;
  for (const BodyFrame& frame : frames) points.push_back(soles.At(Place(rest_joints, frame)));
  LockFeet(rest_joints, soles, FindContacts(points, frame_rate), frames);
  for (int t = 0; t < clip.NumFrames(); ++t) {
    clip.trans.col(t) = frames[t].pelvis - rest_joints.col(0);
    for (int j = 0; j < kNumBodyJoints; ++j) {
      clip.pose[t].col(j) =
          UnwrapAxisAngle(LogSO3(frames[t].local[j].toRotationMatrix()), clip.pose[t].col(j));
    }
  }
  return clip;
}

}  // namespace holdfast
