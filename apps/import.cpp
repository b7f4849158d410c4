// SPDX-License-Identifier: MIT
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/common.h"
#include "geometry/error.h"
#include "geometry/io/import_motion.h"
#include "geometry/skeleton_map.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

struct Options {
  CommonOptions common;
  std::string motion;
  std::string output;
  std::string body;
  std::string map;
  std::string skeleton;
  std::string up = "y";
  std::vector<double> betas;
  double fps = 30;
  double source_fps = 0;
  double metres_per_unit = 0;
  bool keep_ground = false;
};
std::string Describe(const Options& options, const Clip& clip, const ImportReport& report) {
  const RetargetReport& fit = report.retarget;
  std::string text = fmt::format(
      "{}: {} frames at {:g} Hz, of {} at {:g} Hz\n"
      "  {}, skeleton '{}': {} of its {} joints used{}\n"
      "  lengths times {:.4f}, heights moved by {:+.1f} mm onto the ground\n",
      options.output, clip.NumFrames(), clip.frame_rate, report.source_frames,
      report.source_frame_rate, report.format, report.skeleton, report.mapped_joints,
      report.source_joints, fit.same_skeleton ? ", rests like SMPL-X: rotations copied" : "",
      fit.scale, 1e3 * fit.ground_offset_m);
  if (!report.missing_body_joints.empty()) {
    text += fmt::format("  not in the source, filled in: {}\n",
                        fmt::join(report.missing_body_joints, ", "));
  }
  text += fmt::format(
      "  limbs against the source, each bone at the body's length: mean {:.1f} mm, largest {:.1f} "
      "mm\n"
      "  ankles against the source, scaled: mean {:.1f} mm, largest {:.1f} mm\n"
      "  soles on the ground: mean height {:+.1f} mm, lowest {:+.1f} mm\n",
      fit.mean_joint_error_mm, fit.max_joint_error_mm, fit.mean_ankle_error_mm,
      fit.max_ankle_error_mm, 1e3 * fit.mean_sole_height_m, 1e3 * fit.min_sole_height_m);
  return text;
}

nlohmann::json Summary(const Options& options, const Clip& clip, const ImportReport& report) {
  const RetargetReport& fit = report.retarget;
  nlohmann::json summary = JsonHead("holdfast/import/1", options.common);
  summary["output"] = options.output;
  summary["format"] = report.format;
  summary["skeleton"] = report.skeleton;
  summary["source"] = {{"joints", report.source_joints},
                       {"joints_used", report.mapped_joints},
                       {"unused", report.unused_source_joints},
                       {"frames", report.source_frames},
                       {"frame_rate_hz", report.source_frame_rate},
                       {"notes", report.notes}};
  summary["frames"] = clip.NumFrames();
  summary["frame_rate_hz"] = clip.frame_rate;
  summary["filled_in"] = report.missing_body_joints;
  summary["same_skeleton"] = fit.same_skeleton;
  summary["scale"] = fit.scale;
  summary["ground_offset_m"] = fit.ground_offset_m;
  summary["ground_slope"] = fit.ground_slope;
  summary["repaired_hand_frames"] = fit.repaired_hand_frames;
  summary["joint_error_mm"] = {{"mean", fit.mean_joint_error_mm}, {"max", fit.max_joint_error_mm}};
  summary["wrist_error_mm"] = {{"mean", fit.mean_wrist_error_mm}, {"max", fit.max_wrist_error_mm}};
  summary["ankle_error_mm"] = {{"mean", fit.mean_ankle_error_mm}, {"max", fit.max_ankle_error_mm}};
  summary["sole_height_mm"] = {{"mean", 1e3 * fit.mean_sole_height_m},
                               {"min", 1e3 * fit.min_sole_height_m}};
  summary["foot_skate_m_per_s"] = fit.foot_skate;
  summary["protocol"] =
      "joints: knees, ankles, elbows, wrists from hip or shoulder, each source bone at the body's "
      "length, source frames; ankles: from the middle of the hips, source times scale; soles and "
      "skate: the lowest of heels and balls while within 3 cm of the ground";
  return summary;
}

int Run(const Options& options) {
  const CommonOptions& common = options.common;
  RequireNew(options.output, common);
  const auto model = LoadBody(options.body);
  ImportOptions import;
  import.frame_rate = options.fps;
  import.source_frame_rate = options.source_fps;
  import.metres_per_unit = options.metres_per_unit;
  import.up = options.up == "z" ? UpAxis::kZ : UpAxis::kY;
  import.map = options.map;
  import.skeleton = options.skeleton;
  import.find_ground = !options.keep_ground;
  import.betas = Eigen::Map<const Eigen::VectorXd>(options.betas.data(),
                                                   static_cast<Eigen::Index>(options.betas.size()));
  ImportReport report;
  const Clip clip =
      ImportMotion(options.motion, RetargetBodyOf(*model, import.betas), import, &report);
  for (const std::string& note : report.notes) Note(common, "note: " + note);
  if (report.retarget.repaired_hand_frames > 0) {
    Note(common, fmt::format("note: in {} frames a wrist was bent as no wrist bends; bridged from "
                             "the frames around them",
                             report.retarget.repaired_hand_frames));
  }
  WriteClip(clip, options.output);
  PrintResult(common, Summary(options, clip, report), Describe(options, clip, report));
  return kDone;
}

}  // namespace

void AddImportCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand(
      "import", "Bring a motion (BVH, ASF/AMC; plain or gzip'd) onto the SMPL-X skeleton");
  command->add_option("motion", options->motion, "Motion file (.bvh .amc .gz), told by its content")
      ->required();
  command->add_option("-o,--output", options->output, "Clip to write (.npz)")->required();
  command->add_option("--fps", options->fps, "Frame rate of the clip; 0 keeps the file's")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1000.0));
  command
      ->add_option("--source-fps", options->source_fps,
                   "Frame rate of the file where it does not tell (AMC: 120)")
      ->check(CLI::Range(1.0, 1000.0));
  command
      ->add_option("--metres-per-unit", options->metres_per_unit,
                   "Length unit of the file [BVH: 0.01; ASF: its own]")
      ->check(CLI::Range(1e-6, 1e3));
  command->add_option("--up", options->up, "Axis that is up in the file's world")
      ->capture_default_str()
      ->check(CLI::IsMember({"y", "z"}));
  command->add_option("--map", options->map,
                      fmt::format("JSON map of joint names {{\"source joint\": \"smplx joint\"}}; "
                                  "known without: {}",
                                  fmt::join(KnownSkeletons(), "; ")));
  command->add_option("--asf", options->skeleton, "Skeleton of an .amc [looked for beside it]");
  command->add_option("--body", options->body, "SMPL-X .npz [the embedded body]");
  command->add_option("--betas", options->betas, "Shape of the body, numbers with commas between")
      ->delimiter(',');
  command->add_flag("--keep-ground", options->keep_ground,
                    "Leave heights as they are instead of standing the feet on z = 0");
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast import walk.bvh -o walk.npz\n"
      "  holdfast import 07_03.amc.gz --asf 07.asf.gz --fps 60 -o walk.npz --json\n"
      "  holdfast import dance.bvh --map map.json --up z --metres-per-unit 1 -o d.npz\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
