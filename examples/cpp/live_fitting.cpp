// SPDX-License-Identifier: MIT
// Fits an object frame by frame, as a live program does: poses come in, the object's pose comes
// out.
//
//   live_fitting [OBJECT [CLIP]]
//
// Here the poses are those of a clip; a tracker gives them in its place. Prints a line per frame:
// the object's translation (meters) and unit quaternion in the world, energy and time of the solve.
#include <array>
#include <cstdio>
#include <string>

#include "geometry/import/load_clip.h"
#include "solver/carry/first_grasp.h"
#include "solver/fit/frame_fitter.h"

using namespace holdfast;

int main(int argc, char** argv) try {
  const PreparedObject object = PrepareObject(LoadObject(argc > 1 ? argv[1] : "mug"));
  const LoadedClip motion = LoadClip(argc > 2 ? argv[2] : "demo_drink");
  const double frame_s = 1.0 / motion.clip.frame_rate;

  // Once for each person: the right hand, as its 45 finger angles move it.
  const HandModel hand(motion.body.model, motion.body.betas, Side::kRight);

  // A grasp in the first frame, found for the motion that is known so far: here that frame alone.
  Clip start = Slice(motion.clip, 0, 1);
  const FirstGrasp grasp = GraspInFirstFrame(
      hand, object, BodySurface(motion.body.model, motion.body.betas), 1, {}, start);
  if (!grasp.found) {
    std::fprintf(stderr, "live_fitting: no grasp of %s: %s\n", object.object.name.c_str(),
                 grasp.status.c_str());
    return 1;
  }

  // The hand takes hold: what it touches now, at which distances, is kept from here on.
  const std::array<const HandModel*, 1> hands = {&hand};
  FrameFitter fitter(hands, object.fit, FitOptions(), frame_s);
  fitter.Place(ObjectPose(start.object->Pose(0)));
  fitter.TakeHold(Side::kRight, start.pose[0], start.trans.col(0),
                  FingersOf(start.pose[0], Side::kRight));
  fitter.Refine(Side::kRight, start.pose[0], start.trans.col(0), true);

  std::printf("time_s,x,y,z,qw,qx,qy,qz,energy,ms,stop\n");
  for (int t = 1; t < motion.clip.NumFrames(); ++t) {
    const FrameReport frame = fitter.Solve(motion.clip.pose[t], motion.clip.trans.col(t));
    const ObjectPose& pose = fitter.Object();  // fitter.Body() has the fitted fingers
    const Eigen::Quaterniond& q = pose.orientation;
    std::printf("%.4f,%.5f,%.5f,%.5f,%.5f,%.5f,%.5f,%.5f,%.5g,%.3f,%s\n", t * frame_s,
                pose.translation.x(), pose.translation.y(), pose.translation.z(), q.w(), q.x(),
                q.y(), q.z(), frame.energy_total, frame.solve_ms,
                std::string(StopReasonName(frame.stop)).c_str());
  }
  return 0;
} catch (const Error& error) {  // where, what is wrong, what to do
  std::fprintf(stderr, "live_fitting: %s\n", error.what());
  return 1;
}
