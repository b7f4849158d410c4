// SPDX-License-Identifier: MIT
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "generator/body/hand_onto_body.h"
#include "geometry/error.h"
#include "geometry/io/motion/motion_file.h"
#include "geometry/retarget/convert_parameters.h"

namespace holdfast::apps {
namespace {

namespace fs = std::filesystem;

struct ConvertCommand {
  CommonOptions common;
  std::string clip;
  std::string from, to;
  std::string output;
  std::string layout = "auto";
  std::string onto;
  std::string from_hands = "auto";
  std::string to_hands = "complete";
  int betas = kConvertedBetas;
};

// Imports files of other programs without changing their world frame.
LoadedClip ReadSource(const ConvertCommand& options, const std::shared_ptr<const BodyModel>& from) {
  ImportFileOptions import;
  import.parameters.up = UpAxis::kZ;
  import.parameters.keep_ground = true;
  if (options.from_hands != "auto") {
    import.parameters.flat_hand_mean = options.from_hands == "complete";
  }
  LoadedClip source = LoadClip(options.clip, from, options.common, import);
  if (!source.imported && options.from_hands == "relative") {
    for (JointPose& pose : source.clip.pose) pose = AddHandMean(*from, pose);
  }
  return source;
}

ParameterLayout LayoutFor(const ConvertCommand& options, ModelKind kind) {
  const bool as_json = fs::path(options.output).extension() == ".json";
  if (options.layout == "amass") return ParameterLayout::kAmass;
  if (options.layout == "auto")
    return as_json ? ParameterLayout::kPackage : ParameterLayout::kAmass;
  const std::string family = LoneHand(kind) ? "mano" : std::string(ModelKindName(kind));
  if (options.layout != family) {
    throw Error("--layout " + options.layout,
                fmt::format("the parameters are those of a {} model", family),
                fmt::format("Give --layout {}, amass or auto", family));
  }
  return ParameterLayout::kPackage;
}

std::string Text(const ConvertCommand& options, const BodyModel& from, const BodyModel& to,
                 const Conversion& converted) {
  std::string text = fmt::format(
      "{}: {} frames, {} ({}) to {} ({})\n"
      "  joints differ by {:.3f} mm on average, {:.3f} mm at most, over {} joints\n",
      options.output, converted.clip.NumFrames(), from.Name(), ModelKindName(from.Kind()),
      to.Name(), ModelKindName(to.Kind()), converted.mean_mm, converted.max_mm,
      converted.joints.size());
  std::vector<JointResidual> worst = converted.joints;
  std::ranges::stable_sort(worst, std::ranges::greater{}, &JointResidual::max_mm);
  if (worst.size() > 5) worst.resize(5);
  for (const JointResidual& joint : worst) {
    text += fmt::format("    {:<16} {:8.3f} mean {:8.3f} max\n",
                        kJointNames[static_cast<std::size_t>(joint.joint)], joint.mean_mm,
                        joint.max_mm);
  }
  if (converted.vertex_mean_mm) {
    text += fmt::format("  vertices differ by {:.3f} mm on average, {:.3f} mm at most\n",
                        *converted.vertex_mean_mm, *converted.vertex_max_mm);
  }
  if (const auto& arms = converted.arms; arms && arms->frames_out_of_reach > 0) {
    text += fmt::format("  the hand is out of the arm's reach in {} frames, by {:.1f} mm at most\n",
                        arms->frames_out_of_reach, arms->max_missing_mm);
  }
  for (const std::string& item : converted.lost) text += fmt::format("  not converted: {}\n", item);
  return text;
}

int Run(const ConvertCommand& options) {
  const CommonOptions& common = options.common;
  RequireNew(options.output, common);
  const std::shared_ptr<const BodyModel> to = LoadBody(options.to);
  if (const std::string note = to->ShapeNote(); !note.empty()) Note(common, note);
  const ParameterLayout layout = LayoutFor(options, to->Kind());
  const LoadedClip source = ReadSource(options, LoadBody(options.from));
  const Clip& clip = source.clip;
  const ClipBody& from = source.body;
  Conversion converted;
  if (options.onto.empty()) {
    converted = {ConvertClip(clip, from.model, from.betas, to, options.betas), {}};
  } else {
    LoadedClip onto = LoadClip(options.onto, to, common);
    converted = ConvertOntoBody(clip, from, std::move(onto.clip), onto.body);
  }
  Clip out = converted.clip;
  const bool flat = options.to_hands == "complete";
  if (!flat) {
    for (JointPose& pose : out.pose) pose = RemoveHandMean(*to, pose);
  }
  WriteParameters(out, to->Kind(), layout, flat, options.output);

  nlohmann::json summary = JsonHead("holdfast/convert/1", common);
  summary["output"] = options.output;
  summary["from"] = {{"model", from.model->Name()}, {"kind", ModelKindName(from.model->Kind())}};
  summary["to"] = {{"model", to->Name()}, {"kind", ModelKindName(to->Kind())}};
  summary["frames"] = out.NumFrames();
  summary["betas"] = std::vector<double>(out.betas.begin(), out.betas.end());
  summary["hands"] = options.to_hands;
  summary.update(ConversionJson(converted));
  PrintResult(common, summary, Text(options, *from.model, *to, converted));
  return kDone;
}

}  // namespace

void AddConvertCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<ConvertCommand>();
  CLI::App* command =
      app.add_subcommand("convert", "Convert parameters between body models: SMPL-X, SMPL-H, MANO");
  command->add_option("clip", options->clip, kClipHelp)->required();
  command->add_option(
      "--from-body", options->from,
      "Model of the clip: SMPL-X, SMPL-H or MANO (.npz, .pkl); the embedded body if "
      "left out");
  command->add_option("--to-body", options->to, "Body model of the result")->required();
  command
      ->add_option("-o,--output", options->output,
                   ".npz in AMASS layout (SMPL-X: a clip; SMPL-H: poses (T,156)), or .json with "
                   "the array names of the smplx package")
      ->required();
  AddOption(*command, "--layout", options->layout,
            "Array names: amass; smplx, smplh, mano: those of the smplx package; auto: from the "
            "file extension",
            CLI::IsMember({"auto", "amass", "smplx", "smplh", "mano"}));
  AddOption(*command, "--from-hands", options->from_hands,
            "Finger angles of the clip: complete (flat_hand_mean), relative to its model's mean "
            "hand, or auto: by the clip's format",
            CLI::IsMember({"auto", "complete", "relative"}));
  AddOption(*command, "--to-hands", options->to_hands,
            "Finger angles of the result: complete (flat_hand_mean), or relative to its "
            "model's mean hand",
            CLI::IsMember({"complete", "relative"}));
  AddOption(*command, "--betas", options->betas,
            "Number of shape coefficients to solve for; 0: the mean shape", CLI::Range(0, 300));
  command->add_option("--onto", options->onto,
                      "For a clip of a hand alone: the clip of the body to attach it to. In every "
                      "frame, the arm is solved so that the wrist is at the hand");
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast convert walk.npz --from-body SMPLX_NEUTRAL.npz --to-body SMPLH_MALE.pkl -o "
      "walk_h.npz\n"
      "  holdfast convert held/clip.npz --to-body MANO_RIGHT.pkl -o hand.json --to-hands relative\n"
      "Rotations are kept; trans is corrected for the offset between the models' pelvises (for a "
      "hand:\n"
      "wrists); betas are fitted to the joints; the remaining error is reported for each joint.\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
