// SPDX-License-Identifier: MIT
#include "geometry/clip/clip.h"

#include "geometry/clip/clip_arrays.h"
#include "geometry/io/container/npz.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

namespace {

using holdfast::fuzz::Require;

void RequireSame(const std::optional<holdfast::ObjectTrack>& a,
                 const std::optional<holdfast::ObjectTrack>& b) {
  Require(a.has_value() == b.has_value(), "a track comes back");
  if (!a) return;
  Require(a->trans == b->trans && a->orient == b->orient, "a track comes back the same");
  Require(a->name == b->name && a->mesh == b->mesh, "a track's names come back the same");
}

}  // namespace

HOLDFAST_FUZZ_TARGET(clip) {
  const holdfast::Clip clip = holdfast::ReadClip(holdfast::NpzReader(trial.Bytes(), "clip.npz"));
  trial.Accept();
  Require(clip.NumFrames() > 0 && clip.trans.cols() == clip.NumFrames(), "one root per frame");
  Require(clip.trans.allFinite(), "translations are finite");
  Require(clip.holding_hand.empty() || clip.holding_hand.size() == clip.pose.size(),
          "holding_hand has one entry per frame, or none");

  const holdfast::fuzz::ScratchFile file(".npz");
  holdfast::WriteClip(clip, file.Path());
  const holdfast::Clip again = holdfast::ReadClip(file.Path());
  Require(again.frame_rate == clip.frame_rate, "the frame rate comes back the same");
  Require(again.trans == clip.trans, "translations come back the same");
  Require(again.pose == clip.pose, "poses come back the same");
  Require(again.betas == holdfast::WrittenBetas(clip), "betas come back the same");
  Require(again.v_template == clip.v_template, "the subject's surface comes back the same");
  Require(again.holding_hand == clip.holding_hand, "holding hands come back the same");
  Require(again.gender == clip.gender && again.subject == clip.subject &&
              again.action == clip.action && again.body_model == clip.body_model &&
              again.surface_model_type == clip.surface_model_type,
          "texts come back the same");
  RequireSame(again.object, clip.object);
  RequireSame(again.table, clip.table);
}
