// SPDX-License-Identifier: MIT
#include "geometry/import/import_motion.h"

#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "geometry/conventions/posture.h"
#include "geometry/error.h"
#include "geometry/import/file_kind.h"
#include "geometry/io/container/byte_source.h"
#include "geometry/io/container/text_scanner.h"
#include "geometry/io/gltf/gltf_reader.h"
#include "geometry/io/markers/marker_recording.h"
#include "geometry/io/motion/array_motion.h"
#include "geometry/io/motion/asf_amc.h"
#include "geometry/io/motion/bvh.h"
#include "geometry/io/motion/motion_file.h"
#include "geometry/io/pickle/data_file.h"
#include "geometry/retarget/skeleton_map.h"
#include "geometry/rotation.h"

namespace holdfast {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMotionHeadBytes = 4096;

FileKind RecognizeMotion(std::string_view text) {
  if (LooksLikeGltf(text.substr(0, kMotionHeadBytes))) return FileKind::kGltf;
  if (!MarkerFormatOf(text).empty()) return FileKind::kMarkers;
  if (text.starts_with("Kaydara FBX Binary") || text.starts_with("; FBX")) return FileKind::kFbx;
  const FileKind kind = MotionTextKind(text);
  const bool acclaim = TextScanner("", text, '#').Next().starts_with(':');
  return kind == FileKind::kUnknown && acclaim ? FileKind::kAsf : kind;
}

// Motions in arrays are recognized by names and shapes, which are stored inside the archive.
bool HoldsArrayMotion(const std::filesystem::path& path, std::string_view head) {
  if (!MayBeArrayMotion(head)) return false;
  try {
    return LooksLikeArrayMotion(DataFile(path));
  } catch (const Error&) {
    return false;  // another reader reports the fault
  }
}

SourceMotion ReadAnyMotion(const std::filesystem::path& path, const ImportOptions& options) {
  std::vector<std::string> notes;
  std::string text = PlainText(ReadGzipText(path), notes);
  const std::string where = path.string();
  const FileKind kind = HoldsArrayMotion(path, text) ? FileKind::kTorch : RecognizeMotion(text);
  if (kind != FileKind::kGltf &&
      !(options.animation.empty() && options.character.empty() && options.prop.empty())) {
    throw Error(where, "holds one motion of one skeleton",
                "Omit the choice of animation, character and object: it applies only to glTF");
  }
  switch (kind) {
    case FileKind::kBvh: {
      SourceMotion motion = ParseBvh(text, where, options.meters_per_unit.value_or(0.01));
      if (options.source_frame_rate) motion.frame_rate = *options.source_frame_rate;
      motion.notes.insert(motion.notes.begin(), notes.begin(), notes.end());
      return motion;
    }
    case FileKind::kAmc: {
      const std::filesystem::path skeleton =
          options.skeleton.empty() ? FindAsfBeside(path) : fs::path(options.skeleton);
      const std::string asf = PlainText(ReadGzipText(skeleton), notes);
      SourceMotion motion =
          ParseAmc(asf, skeleton.string(), text, where, options.meters_per_unit.value_or(0.0),
                   options.source_frame_rate.value_or(kAmcFrameRate));
      motion.notes = std::move(notes);
      if (!options.source_frame_rate) {
        motion.notes.push_back(
            fmt::format("warning: AMC files have no frame rate: assuming CMU's {:g} Hz ('holdfast "
                        "import --source-fps' overrides this)",
                        kAmcFrameRate));
      }
      return motion;
    }
    case FileKind::kGltf: {
      GltfMotionOptions gltf;
      gltf.frame_rate = options.source_frame_rate.value_or(0.0);
      if (options.meters_per_unit) gltf.meters_per_unit = *options.meters_per_unit;
      gltf.animation = options.animation;
      gltf.character = options.character;
      gltf.prop = options.prop;
      return ParseGltfMotion(std::move(text), where, path.parent_path(), gltf);
    }
    case FileKind::kTorch: {  // in arrays
      SourceMotion motion = ReadArrayMotion(DataFile(path));
      if (options.source_frame_rate) {
        motion.frame_rate = *options.source_frame_rate;
      } else {
        motion.notes.push_back(
            fmt::format("no frame rate in the file: assuming {:g} Hz, that of {}",
                        motion.frame_rate, motion.format));
      }
      return motion;
    }
    case FileKind::kAsf:
      throw Error(where, "is an Acclaim skeleton (.asf), which holds no motion",
                  "Give the .amc, and this file with --asf if it is in another folder");
    case FileKind::kMarkers:
      throw Error(
          where,
          "is a marker recording: it holds paths of points on the skin, not joint rotations, and "
          "does not state where each marker is attached",
          "Fit a body to it with 'holdfast solve', or list its content with 'holdfast doctor'");
    case FileKind::kFbx:
      throw Error(where, kFbxProblem, "Export .glb from Blender, and import that");
    default:
      break;
  }
  throw Error(where, "is not a BVH, ASF/AMC or glTF motion (judged by its first words)",
              "Give a file that begins with HIERARCHY (BVH) or :FULLY-SPECIFIED (AMC), a .glb or "
              "a .gltf");
}

// Adds warnings where the body follows the source poorly.
void AddDoubts(const RetargetReport& retarget, std::vector<std::string>& notes) {
  constexpr double kFarPlace_mm = 30;
  constexpr double kFarDirection = 15 * kDegree;
  constexpr const char* kLook = "(mean over the frames): check it with 'holdfast render'";
  if (retarget.worst_place_mm > kFarPlace_mm) {
    notes.push_back(fmt::format("warning: {} is {:.0f} mm off its position in the source {}",
                                kJointNames[retarget.worst_place_joint], retarget.worst_place_mm,
                                kLook));
  }
  if (retarget.trunk_error_rad > kFarDirection) {
    notes.push_back(
        fmt::format("warning: the trunk is {:.0f} degrees off its direction in the source {}",
                    retarget.trunk_error_rad / kDegree, kLook));
  }
  for (const int side : {0, 1}) {
    if (retarget.hand_error_rad[side] < kFarDirection) continue;
    notes.push_back(
        fmt::format("warning: the {} hand is {:.0f} degrees off its direction in the source {}",
                    side == 0 ? "left" : "right", retarget.hand_error_rad[side] / kDegree, kLook));
  }
}

}  // namespace

bool LooksLikeMotionFile(const std::filesystem::path& path) {
  // Markers are recognized so that ReadMotion can report why they are not imported.
  std::vector<std::string> ignored;
  const std::string head = PlainText(ReadGzipHead(path, kMotionHeadBytes), ignored);
  if (HoldsArrayMotion(path, head)) return true;
  const FileKind kind = RecognizeMotion(head);
  return kind != FileKind::kUnknown && kind != FileKind::kAsf;
}

SourceMotion ReadMotion(const std::filesystem::path& path, const ImportOptions& options) {
  SourceMotion motion = ReadAnyMotion(path, options);
  RequireInRange(motion, path.string());
  return motion;
}

Clip ImportMotion(const std::filesystem::path& path, const RetargetBody& body,
                  const ImportOptions& options, ImportReport* report) {
  return ImportMotion(ReadMotion(path, options), path.string(), body, options, report);
}

Clip ImportMotion(const SourceMotion& motion, const std::string& where, const RetargetBody& body,
                  const ImportOptions& options, ImportReport* report) {
  const SkeletonMap map =
      options.map.empty() ? RecognizeSkeleton(motion, where) : ReadSkeletonMap(options.map, motion);
  std::vector<std::string> notes = motion.notes;
  RetargetOptions retarget;
  retarget.frame_rate = options.frame_rate;
  retarget.up = options.up.value_or(UpAxis::kY);
  const bool own = !motion.body_model.empty();  // written by Holdfast: y is up
  if (!options.up && !own) {
    const MotionUp up = FindMotionUp(motion, map);
    retarget.up = up.axis;
    if (!up.certain) {
      notes.emplace_back(
          "the up axis is ambiguous: the body lies, crawls or bends for long; y is used by "
          "convention (--up overrides this)");
    } else if (up.axis != UpAxis::kY) {
      notes.push_back(
          fmt::format("{0} is up: the head is above the feet along {0} in {1:.0f} % of the frames "
                      "(--up overrides this)",
                      UpAxisName(up.axis), 100 * up.share));
    }
  }
  retarget.find_ground = !options.keep_ground;
  RetargetReport retarget_report;
  Clip clip = Retarget(motion, map, body, retarget, &retarget_report);
  AddDoubts(retarget_report, notes);
  clip.betas = options.betas;
  if (!motion.gender.empty()) clip.gender = motion.gender;

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
    report->notes = std::move(notes);
    report->up = retarget.up;
    report->source_frames = motion.NumFrames();
    report->source_frame_rate = motion.frame_rate;
    report->frames = clip.NumFrames();
    report->retarget = retarget_report;
  }
  return clip;
}

}  // namespace holdfast
