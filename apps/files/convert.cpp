// SPDX-License-Identifier: MIT
#include <algorithm>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "apps/clip_input.h"
#include "apps/common.h"
#include "generator/body/hand_onto_body.h"
#include "geometry/error.h"
#include "geometry/io/motion/parameter_writer.h"
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
  int betas = 10;
};

// A file of another program is imported with its world left alone.
LoadedClip ReadSource(const ConvertCommand& options, const std::shared_ptr<const BodyModel>& from) {
  ImportFileOptions import;
  import.parameters.up = WorldUp::kPlusZ;
  import.parameters.find_ground = false;
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

struct Result {
  ConvertedClip converted;
  std::optional<HandOntoBodyReport> arms;
};

// A hand alone onto the body of another clip.
Result PutOnto(const ConvertCommand& options, const Clip& hand, const ClipBody& from,
               const std::shared_ptr<const BodyModel>& to) {
  Result result;
  Clip& body = result.converted.clip;
  LoadedClip onto = LoadClip(options.onto, to, options.common);
  const ClipBody person = std::move(onto.body);
  body = std::move(onto.clip);
  result.arms = PutHandOntoBody(hand, *from.model, from.betas, *person.model, person.betas, body);
  const auto rest = [](const BodyModel& model, const Eigen::VectorXd& betas) {
    return model.RestJoints(model.ShapedVertices(betas));
  };
  ConvertedClip& converted = result.converted;
  converted.joints =
      CompareJoints(hand, rest(*from.model, from.betas), body, rest(*person.model, person.betas),
                    CommonJoints(*from.model, *person.model));
  for (const JointResidual& joint : converted.joints) {
    converted.mean_mm += joint.mean_mm / static_cast<double>(converted.joints.size());
    converted.max_mm = std::max(converted.max_mm, joint.max_mm);
  }
  if (hand.object) body.object = hand.object;
  body.holding_hand = hand.holding_hand;
  converted.lost = {"the hand's betas: a body has its own"};
  return result;
}

std::string Text(const ConvertCommand& options, const BodyModel& from, const BodyModel& to,
                 const Result& result) {
  const ConvertedClip& converted = result.converted;
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
  if (result.arms && result.arms->frames_out_of_reach > 0) {
    text += fmt::format("  the hand is out of the arm's reach in {} frames, by {:.1f} mm at most\n",
                        result.arms->frames_out_of_reach, result.arms->max_missing_mm);
  }
  for (const std::string& item : converted.lost)
    text += fmt::format("  not carried over: {}\n", item);
  return text;
}

int Run(const ConvertCommand& options) {
  const CommonOptions& common = options.common;
  RequireNew(options.output, common);
  const std::shared_ptr<const BodyModel> to = LoadBody(options.to);
  const ParameterLayout layout = LayoutFor(options, to->Kind());
  const LoadedClip source = ReadSource(options, LoadBody(options.from));
  const Clip& clip = source.clip;
  const ClipBody& from = source.body;
  ConvertOptions convert;
  convert.num_betas = options.betas;
  Result result;
  if (options.onto.empty()) {
    result.converted = ConvertClip(clip, from.model, from.betas, to, convert);
  } else {
    result = PutOnto(options, clip, from, to);
  }
  Clip out = result.converted.clip;
  const bool flat = options.to_hands == "complete";
  if (!flat) {
    for (JointPose& pose : out.pose) pose = 2.0 * pose - AddHandMean(*to, pose);
  }
  WriteParameters(out, to->Kind(), layout, flat, options.output);

  const ConvertedClip& converted = result.converted;
  nlohmann::json summary = JsonHead("holdfast/convert/1", common);
  summary["output"] = options.output;
  summary["from"] = {{"model", from.model->Name()}, {"kind", ModelKindName(from.model->Kind())}};
  summary["to"] = {{"model", to->Name()}, {"kind", ModelKindName(to->Kind())}};
  summary["frames"] = out.NumFrames();
  summary["betas"] = std::vector<double>(out.betas.begin(), out.betas.end());
  summary["hands"] = options.to_hands;
  nlohmann::json joints = nlohmann::json::object();
  for (const JointResidual& joint : converted.joints) {
    joints[std::string(kJointNames[static_cast<std::size_t>(joint.joint)])] = {
        {"mean_mm", joint.mean_mm}, {"max_mm", joint.max_mm}};
  }
  summary["residual"] = {
      {"joints", joints}, {"mean_mm", converted.mean_mm}, {"max_mm", converted.max_mm}};
  if (converted.vertex_mean_mm) {
    summary["residual"]["vertex_mean_mm"] = *converted.vertex_mean_mm;
    summary["residual"]["vertex_max_mm"] = *converted.vertex_max_mm;
  }
  if (result.arms) {
    summary["arm"] = {{"frames_out_of_reach", result.arms->frames_out_of_reach},
                      {"max_missing_mm", result.arms->max_missing_mm}};
  }
  summary["not_carried_over"] = converted.lost;
  PrintResult(common, summary, Text(options, *from.model, *to, result));
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
  command->add_option("--to-body", options->to, "Model that the result is for")->required();
  command
      ->add_option(
          "-o,--output", options->output,
          ".npz as AMASS has it (SMPL-X: a clip; SMPL-H: poses (T,156)), or .json with the "
          "smplx package's names")
      ->required();
  AddOption(*command, "--layout", options->layout,
            "Names of the arrays. amass; smplx, smplh, mano: the smplx package's; auto: by "
            "the extension",
            CLI::IsMember({"auto", "amass", "smplx", "smplh", "mano"}));
  AddOption(*command, "--from-hands", options->from_hands,
            "Finger angles of the clip: complete (flat_hand_mean), relative to its model's "
            "mean hand, or auto: as its format has them",
            CLI::IsMember({"auto", "complete", "relative"}));
  AddOption(*command, "--to-hands", options->to_hands,
            "Finger angles of the result: complete (flat_hand_mean), or relative to its "
            "model's mean hand",
            CLI::IsMember({"complete", "relative"}));
  AddOption(*command, "--betas", options->betas,
            "Shape coefficients of the result to solve for; 0: its mean shape", CLI::Range(0, 300));
  command->add_option("--onto", options->onto,
                      "From a hand alone to a body: the clip whose body it belongs to. The arm "
                      "brings its wrist to the hand, frame by frame");
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast convert walk.npz --from-body SMPLX_NEUTRAL.npz --to-body SMPLH_MALE.pkl -o "
      "walk_h.npz\n"
      "  holdfast convert held/clip.npz --to-body MANO_RIGHT.pkl -o hand.json --to-hands relative\n"
      "Rotations are kept; trans is corrected for the models' pelvises (of a hand, wrists); betas "
      "are\n"
      "fitted to the joints; what is left is reported for each joint.\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
