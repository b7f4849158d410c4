// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include "apps/common.h"
#include "geometry/io/mesh/mesh_io.h"
#include "geometry/mesh/decimate.h"

namespace holdfast::apps {
namespace {

struct DecimateCommand {
  CommonOptions common;
  std::string mesh;
  std::string output;
  std::string method = std::string(Name(DecimateOptions{}.method));
  DecimateOptions decimate;
};

int Run(const DecimateCommand& options) {
  const CommonOptions& common = options.common;
  RequireNew(options.output, common);
  DecimateOptions decimate = options.decimate;
  decimate.method = ParseDecimateMethod(options.method);
  const LoadedObject object = LoadObject(options.mesh);
  for (const std::string& note : object.notes) Note(common, "note: " + note);
  const DecimateResult result =
      NamingSource("mesh", options.mesh, [&] { return Decimate(object.mesh, decimate); });
  for (const std::string& note : result.notes) Note(common, "note: " + note);
  WriteMesh(result.mesh, options.output);

  nlohmann::json summary = JsonHead("holdfast/decimate/1", common);
  summary["output"] = options.output;
  summary["method"] = Name(result.method);
  summary["vertices"] = {{"before", object.mesh.NumVertices()},
                         {"after", result.mesh.NumVertices()}};
  std::string text =
      fmt::format("{}: {} vertices of {} ({})\n", options.output, result.mesh.NumVertices(),
                  object.mesh.NumVertices(), Name(result.method));
  if (result.distance) {
    const SurfaceDistance& distance = *result.distance;
    summary["hausdorff_mm"] = {{"forward", 1e3 * distance.hausdorff_forward_m},
                               {"backward", 1e3 * distance.hausdorff_backward_m}};
    summary["mean_distance_mm"] = {{"forward", 1e3 * distance.mean_forward_m},
                                   {"backward", 1e3 * distance.mean_backward_m}};
    text += fmt::format(
        "  Hausdorff distance {:.3f} mm forward, {:.3f} mm backward; mean {:.3f} mm forward, "
        "{:.3f} mm backward\n",
        1e3 * distance.hausdorff_forward_m, 1e3 * distance.hausdorff_backward_m,
        1e3 * distance.mean_forward_m, 1e3 * distance.mean_backward_m);
  }
  PrintResult(common, summary, text);
  return kDone;
}

}  // namespace

void AddDecimateCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<DecimateCommand>();
  CLI::App* command = app.add_subcommand(
      "decimate", "Simplify a mesh by edge collapse to exactly 300 (or --vertices) vertices");
  command->add_option("mesh", options->mesh, kObjectHelp)->required();
  command->add_option("-o,--output", options->output, "Mesh to write (.obj .ply .stl .off)")
      ->required();
  AddOption(*command, "--vertices", options->decimate.vertices, "Number of vertices of the result",
            CLI::Range(4, 100'000'000));
  AddOption(*command, "--method", options->method,
            "Edge-collapse cost: lindstrom-turk, garland-heckbert or "
            "garland-heckbert-probabilistic");
  AddCommonOptions(*command, options->common, true,
                   "  holdfast decimate bottle.obj -o bottle_300.ply\n"
                   "  holdfast decimate mug -o mug_500.obj --vertices 500 --json\n");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace holdfast::apps
