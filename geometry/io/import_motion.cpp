// SPDX-License-Identifier: MIT
#include "geometry/io/import_motion.h"

#include <string_view>

#include "geometry/error.h"
#include "geometry/io/asf_amc.h"
#include "geometry/io/bvh.h"
#include "geometry/io/gzip_text.h"
#include "geometry/io/text_scanner.h"
#include "geometry/skeleton_map.h"

namespace holdfast {
namespace {

enum class MotionFormat { kUnknown, kBvh, kAmc, kAsf };

MotionFormat Recognize(std::string_view text) {
  TextScanner scanner("", text, '#');
  const std::string_view first = scanner.Next();
  if (EqualIgnoringCase(first, "HIERARCHY")) return MotionFormat::kBvh;
  for (const std::string_view word :
       {":FULLY-SPECIFIED", ":DEGREES", ":RADIANS", ":SAMPLES-PER-SECOND"}) {
    if (EqualIgnoringCase(first, word)) return MotionFormat::kAmc;
  }
  if (first.starts_with(':')) return MotionFormat::kAsf;
  // An AMC without header: a frame number alone, then "root" and numbers.
  double number = 0;
  if (ParseNumber(first, number) && EqualIgnoringCase(scanner.Next(), "root")) {
    return MotionFormat::kAmc;
  }
  return MotionFormat::kUnknown;
}

}  // namespace

bool LooksLikeMotionFile(const std::filesystem::path& path) {
  const std::string head = ReadGzipHead(path, 4096);
  const MotionFormat format = Recognize(head);
  return format == MotionFormat::kBvh || format == MotionFormat::kAmc;
}

Clip ImportMotion(const std::filesystem::path& path, const RetargetBody& body,
                  const ImportOptions& options, ImportReport* report) {
  const std::string text = ReadGzipText(path);
  SourceMotion motion;
  switch (Recognize(text)) {
    case MotionFormat::kBvh:
      motion = ParseBvh(text, path.string(),
                        options.metres_per_unit > 0 ? options.metres_per_unit : 0.01);
      if (options.source_frame_rate > 0) motion.frame_rate = options.source_frame_rate;
      break;
    case MotionFormat::kAmc: {
      AmcOptions amc;
      amc.skeleton = options.skeleton.empty() ? FindAsfBeside(path) : options.skeleton;
      amc.metres_per_unit = options.metres_per_unit;
      if (options.source_frame_rate > 0) amc.frame_rate = options.source_frame_rate;
      motion =
          ParseAmc(ReadGzipText(amc.skeleton), amc.skeleton.string(), text, path.string(), amc);
      break;
    }
    case MotionFormat::kAsf:
      throw Error(path.string(), "an Acclaim skeleton (.asf), which holds no motion",
                  "Give the .amc, and this file with --asf where it lies elsewhere");
    case MotionFormat::kUnknown:
      throw Error(path.string(), "neither a BVH nor an ASF/AMC motion (by its first words)",
                  "Give a file that begins with HIERARCHY (BVH) or :FULLY-SPECIFIED (AMC)");
  }

  const SkeletonMap map = options.map.empty() ? RecognizeSkeleton(motion, path.string())
                                              : ReadSkeletonMap(options.map, motion);
  RetargetOptions retarget;
  retarget.frame_rate = options.frame_rate;
  retarget.up = options.up;
  retarget.find_ground = options.find_ground;
  RetargetReport retarget_report;
  Clip clip = Retarget(motion, map, body, retarget, &retarget_report);
  clip.betas = options.betas;

  if (report) {
    report->format = motion.format;
    report->skeleton = map.name;
    report->source_joints = motion.NumJoints();
    report->mapped_joints = map.NumMapped();
    report->unused_source_joints = map.UnusedSourceJoints(motion);
    report->missing_body_joints.clear();
    for (int j = 0; j < kNumBodyJoints; ++j) {
      if (map.source[j] < 0) report->missing_body_joints.emplace_back(kJointNames[j]);
    }
    report->notes = motion.notes;
    report->source_frames = motion.NumFrames();
    report->source_frame_rate = motion.frame_rate;
    report->frames = clip.NumFrames();
    report->retarget = retarget_report;
  }
  return clip;
}

}  // namespace holdfast
