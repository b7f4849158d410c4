// SPDX-License-Identifier: MIT
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "generator/body/hand_onto_body.h"
#include "geometry/retarget/convert_parameters.h"

namespace holdfast::apps {
namespace {

struct ConvertCommand {
  CommonOptions common;
  std::string clip;
  std::string from, to;
  std::string output;
  std::string onto;
  ConvertOptions convert;
  ParameterFileOptions file;
};

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
  LayoutOf(*to, options.file, options.output);  // before the work
  if (const std::string note = to->ShapeNote(); !note.empty()) Note(common, note);
  LoadedClip source =
      LoadClip(options.clip, LoadBody(options.from), common, ImportToConvert(options.convert));
  Clip& clip = source.clip;
  const ClipBody& from = source.body;
  if (!source.imported) CompleteHands(options.convert, *from.model, clip);
  Conversion converted;
  if (options.onto.empty()) {
    converted = {ConvertClip(clip, from.model, from.betas, to, options.convert.betas), {}};
  } else {
    LoadedClip onto = LoadClip(options.onto, to, common);
    converted = ConvertOntoBody(clip, from, std::move(onto.clip), onto.body);
  }
  WriteParameters(converted.clip, *to, options.file, options.output);

  nlohmann::json summary = JsonHead("holdfast/convert/1", common);
  summary["output"] = options.output;
  summary["from"] = {{"model", from.model->Name()}, {"kind", ModelKindName(from.model->Kind())}};
  summary["to"] = {{"model", to->Name()}, {"kind", ModelKindName(to->Kind())}};
  summary["frames"] = converted.clip.NumFrames();
  summary["betas"] = std::vector<double>(converted.clip.betas.begin(), converted.clip.betas.end());
  ParameterFileOptions file = options.file;
  summary["hands"] = OptionsJson(OptionsOf(file))["to_hands"];
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
  AddOptions(*command, OptionsOf(options->file));
  AddOptions(*command, OptionsOf(options->convert));
  command->add_option(
      "--onto", options->onto,
      "For a clip of a hand alone: clip of the body to attach the hand to. In every "
      "frame, the arm is solved so that the body's wrist is at the hand's wrist");
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
