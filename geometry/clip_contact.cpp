// SPDX-License-Identifier: MIT
#include "geometry/clip_contact.h"

#include <atomic>
#include <mutex>

#include "geometry/error.h"
#include "geometry/parallel.h"
#include "geometry/rotation.h"

namespace holdfast {

std::vector<ContactMetrics> MeasureClipContact(const Clip& clip, const HandModel& hand,
                                               const SignedDistance& object,
                                               const ContactProtocol& protocol,
                                               const std::function<bool(int, int)>& progress) {
  if (!clip.object) throw Error("clip", "has no object to measure contact with", "Fit one first");
  const int frames = clip.NumFrames();
  std::vector<ContactMetrics> metrics(static_cast<std::size_t>(frames));
  ContactProtocol per_frame = protocol;
  per_frame.threads = 1;
  int done = 0;
  std::mutex progress_mutex;
  std::atomic<bool> stopped{false};
  ParallelFor(frames, protocol.threads, [&](int t) {
    if (stopped) return;
    HandState state(hand);
    state.SetBody(clip.pose[t], clip.trans.col(t));
    state.Evaluate(FingersOf(clip.pose[t], hand.HandSide()), false);
    const Eigen::Matrix3d object_from_world = ExpSO3(clip.object->orient.col(t)).transpose();
    const TriangleMesh hand_in_object{
        object_from_world * (state.Vertices().colwise() - clip.object->trans.col(t)),
        hand.Surface().Faces()};
    metrics[t] = MeasureContact(hand_in_object, object, per_frame);
    if (progress) {
      const std::lock_guard lock(progress_mutex);
      if (!progress(++done, frames)) stopped = true;
    }
  });
  return metrics;
}

}  // namespace holdfast
