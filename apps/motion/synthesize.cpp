// SPDX-License-Identifier: MIT
#include "apps/common.h"
#include "apps/motion/synthesize_job.h"
#include "generator/actions/action_catalog.h"
#include "generator/imos/default_network.h"

namespace holdfast::apps {

void AddSynthesizeCommand(CLI::App& app, int& exit_code) {
  struct Options {
    CommonOptions common;
    SynthesizeCommand command;
  };
  auto options = std::make_shared<Options>();
  SynthesizeCommand& job = options->command;
  CLI::App* command = app.add_subcommand(
      "synthesize",
      "Generate a person who does something with an object: body and object motion from an intent");
  CLI::Option* sentence = command->add_option(
      "sentence", job.sentence, "\"The person drinks from the mug\", in place of --action");
  CLI::Option* action =
      command->add_option("--action", job.action, "The action: " + MadeActionNames())
          ->excludes(sentence);
  CLI::Option* object = command->add_option(
      "--object", job.object,
      "Mesh (.obj .ply .stl .off .glb .gltf) or embedded object; the sentence's if left "
      "out");
  action->needs(object);
  command->add_option("--class", job.job.object_class,
                      "Class of the object for the networks: mug, waterbottle, ... [its name]");
  command->add_option("--from", job.from,
                      "CLIP or CLIP:FRAME of a person with the object in a hand to continue from. "
                      "Without it a person stands at the origin, facing -y");
  AddOptions(*command, OptionsOf(job.job).Without({"object_class"}));
  for (const char* made : {"--start", "--hand"}) {
    command->get_option(made)->excludes(command->get_option("--from"));
  }
  command
      ->add_option("--betas", job.betas,
                   "Body shape at a generated start, coefficients of the body model: 1.5,-0.5")
      ->delimiter(',')
      ->excludes(command->get_option("--from"));
  command->add_flag("--all", job.all,
                    "Keep all samples: samples/NN.npz, best first, before the object is fitted");
  command->add_option("--body", job.body, "Body model in place of the embedded one");
  const bool embedded = imos::HasDefaultNetwork();
  command
      ->add_option("--weights", job.weights,
                   embedded ? "Networks (.safetensors) in place of the embedded ones"
                            : "Networks (.safetensors); this program was built without any")
      ->required(!embedded);
  command->add_option("--action-embeddings", job.action_embeddings,
                      "Embeddings of the 29 actions by label (.npz, .safetensors), for networks "
                      "that were trained with CLIP's");
  command->add_flag_callback(
      "--no-report", [&out = job.write_report] { out = false; }, "Leave out report.html");
  AddOption(*command, "-o,--output", job.output,
            "Folder to make: clip.npz, object.ply, metrics.json, report.html");
  AddCommonOptions(
      *command, options->common, true,
      "  holdfast synthesize --action drink --object mug\n"
      "  holdfast synthesize \"The person takes picture with the camera\" --seed 7 -o picture\n"
      "  holdfast synthesize --action drink --object mug --start table --and-back -o drinks\n"
      "  holdfast synthesize --action pour --object jug.obj --class teapot --hand left -o poured\n"
      "  holdfast synthesize --action inspect --object held/object.ply --class mug --from held \\\n"
      "      -o inspected\n"
      "The best sample: least penetration, least of the object in the body and of joints beyond\n"
      "what captured people do, most contact; the first of equals.\n");
  command->callback([options, &exit_code] {
    const SynthesizeCommand& asked = options->command;
    if (asked.sentence.empty() && asked.action.empty()) {
      throw CLI::RequiredError("A sentence, or --action and --object,");
    }
    const Outcome outcome = RunSynthesize(asked, options->common);
    if (!outcome.summary.is_null()) PrintResult(options->common, outcome.summary, outcome.text);
    exit_code = outcome.exit_code;
  });
}

}  // namespace holdfast::apps
