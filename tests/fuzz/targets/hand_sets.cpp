// SPDX-License-Identifier: MIT
#include "geometry/error.h"
#include "geometry/import/import_file.h"
#include "geometry/import/import_motion.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

namespace {

using holdfast::fuzz::Require;

// The embedded body, and the model whose coefficients HOT3D, DexYCB and ContactPose store.
const holdfast::ImportFileOptions& Options() {
  static const holdfast::ImportFileOptions options = [] {
    holdfast::ImportFileOptions made;
    made.parameters.body = holdfast::BodyModel::Default();
    made.parameters.hand_models = {HOLDFAST_SOURCE_DIR "/tests/fixtures/hand_sets/MANO_RIGHT.pkl"};
    return made;
  }();
  return options;
}

}  // namespace

// Parameters of bodies and hands, as the data sets store them. Motions with their own skeleton have
// targets of their own; fitting a body to them takes too long here.
HOLDFAST_FUZZ_TARGET(hand_sets) {
  const holdfast::fuzz::MemoryFile file(trial.Bytes());
  const holdfast::ImportFileOptions& options = Options();
  if (holdfast::LooksLikeMotionFile(file.Path())) {
    throw holdfast::Error("input", "has its own skeleton", "Fuzz its reader");
  }
  const holdfast::ImportedFile imported = holdfast::ImportFile(file.Path(), options);
  trial.Accept();
  const holdfast::Clip& clip = imported.clip;
  Require(clip.NumFrames() > 0 && clip.trans.cols() == clip.NumFrames(), "one root per frame");
  Require(clip.trans.allFinite(), "translations are finite");
  for (const holdfast::JointPose& pose : clip.pose) Require(pose.allFinite(), "poses are finite");
  if (clip.object) {
    Require(clip.object->trans.cols() == clip.NumFrames() && clip.object->trans.allFinite() &&
                clip.object->orient.allFinite(),
            "the object has a finite pose in every frame");
  }
}
