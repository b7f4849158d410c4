// SPDX-License-Identifier: MIT
// Fits an object to a motion, prints the energies of the frame with the deepest penetration,
// repeats the fit with another weight, scores both results, and writes a clip and a picture.
//
//   first_program [CLIP [OBJECT [FOLDER]]]
//
// Clip and object: files or embedded names (default: demo_drink, mug). Writes FOLDER/clip.npz,
// FOLDER/object.ply and FOLDER/worst.png (default folder: first_program).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>

#include "geometry/clip/clip_arrays.h"
#include "geometry/import/load_clip.h"
#include "geometry/parallel.h"
#include "geometry/render/clip_pictures.h"
#include "solver/carry/carry.h"
#include "solver/score/metric_values.h"

using namespace holdfast;

bool ShowProgress(const char* stage, int done, int total) {
  std::fprintf(stderr, "\r%-8s %3d/%3d%s", stage, done, total, done == total ? "\n" : "");
  return true;  // false stops the fit: status kStopped
}

// The frame with the deepest penetration of those in which a hand holds the object.
int DeepestFrame(const CarryReport& report) {
  const auto depth = [](const ContactScore::Frame& f) { return f.held ? f.penetration_mm : -1.0; };
  const auto& frames = report.contact.frames;
  return static_cast<int>(std::ranges::max_element(frames, {}, depth) - frames.begin());
}

void PrintFrame(const CarryReport& report, int t) {
  const FrameReport& frame = report.fit.frames.at(t);
  std::printf("frame %d: penetration %.2f mm, %d iterations, %s\n", t,
              report.contact.frames.at(t).penetration_mm, frame.iterations,
              std::string(StopReasonName(frame.stop)).c_str());
  for (const EnergyTermInfo& info : EnergyTerms()) {
    if (info.metric != nullptr) std::printf("  %-26s %g\n", info.metric, frame.energies[info.term]);
  }
}

// The largest distance between the objects of two clips of the same length.
double LargestShift_mm(const Clip& a, const Clip& b) {
  return 1e3 * (a.object->trans - b.object->trans).colwise().norm().maxCoeff();
}

MetricValues Score(const Clip& clip, const ClipBody& body, const TriangleMesh& object,
                   int threads) {
  ClipScene scene;
  scene.clip = clip;
  scene.body = body.model;
  scene.betas = body.betas;
  scene.object = object;
  ScoreOptions options;
  options.threads = threads;
  SettleScoreOptions(options);
  return ClipValues(ScoreClip(scene, nullptr, options), options);
}

int main(int argc, char** argv) try {
  const int threads = AvailableThreads();
  const LoadedClip motion = LoadClip(argc > 1 ? argv[1] : "demo_drink");
  const LoadedObject loaded = LoadObject(argc > 2 ? argv[2] : "mug");
  const std::filesystem::path folder = argc > 3 ? argv[3] : "first_program";
  for (const std::string& note : motion.notes) std::printf("note: %s\n", note.c_str());
  for (const std::string& note : loaded.notes) std::printf("note: %s\n", note.c_str());
  std::printf("%s: %d frames at %g Hz\n", loaded.name.c_str(), motion.clip.NumFrames(),
              motion.clip.frame_rate);
  RequireGraspable(loaded, false);  // throws Error for wrong units, FitFailure for wrong sizes
  const PreparedObject object = PrepareObject(loaded, 300, threads);

  CarryOptions options;
  options.threads = threads;
  options.drink = DrinkingHand(motion.clip, motion.body, object).has_value();
  const CarryReport held = CarryObject(motion.clip, motion.body, object, options, ShowProgress);
  if (held.status != CarryStatus::kCarried) {
    std::fprintf(stderr, "first_program: no result: %s\n", held.grasp.status.c_str());
    return 3;
  }
  for (const std::string& warning : held.warnings) std::printf("warning: %s\n", warning.c_str());
  const int worst = DeepestFrame(held);
  PrintFrame(held, worst);

  options.fit.lambda_temporal *= 1000.0;  // smaller changes from frame to frame
  const CarryReport smooth = CarryObject(motion.clip, motion.body, object, options);
  if (smooth.status != CarryStatus::kCarried) return 3;
  std::printf("the object moved by up to %.2f mm\n", LargestShift_mm(held.clip, smooth.clip));

  const MetricValues before = Score(held.clip, motion.body, object.object.mesh, threads);
  const MetricValues after = Score(smooth.clip, motion.body, object.object.mesh, threads);
  for (const char* name : {"penetration_max_mm", "contact_drift_mm", "contact_frames_ratio"}) {
    std::printf("%-26s %8.3f %8.3f\n", name, before.at(name).value_or(NAN),
                after.at(name).value_or(NAN));
  }

  std::filesystem::create_directories(folder);
  WriteClipFiles(held.clip, object.object.mesh, folder);
  ClipPictureOptions picture;
  picture.how.view = ClipView::kHand;
  picture.frame = worst;
  const ClipRenderer renderer(held.clip, motion.body.model, motion.body.betas, &object.object.mesh);
  WritePictures(renderer, PlanPictures(held.clip, PictureFileOf(folder / "worst.png"), picture));
  return 0;
} catch (const FitFailure& failure) {  // valid input without a result
  std::fprintf(stderr, "first_program: %s\n", failure.what());
  return 3;
} catch (const Error& error) {  // invalid input
  std::fprintf(stderr, "first_program: %s: %s\n%s\n", error.Where().c_str(),
               error.Problem().c_str(), error.Remedy().c_str());
  return 1;
}
