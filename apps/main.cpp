// SPDX-License-Identifier: MIT
#include "apps/batch.h"
#include "apps/common.h"
#include "apps/program.h"
#include "geometry/parallel.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

int main(int argc, char** argv) {
  using namespace holdfast::apps;
  using holdfast::FitLibrary;
  holdfast::EndBlasThreads();
#ifdef __GLIBC__
  // Keeps the buffers allocated for every block of frames (megabytes) in the process: pages that
  // were returned to the system are cleared before reuse.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
#endif
  CLI::App app{
      "holdfast: fits objects to moving human hands and generates human motion that reaches "
      "goals.\n\n"
      "  holdfast fit demo_drink mug -o held      # fit a mug to a drinking motion\n"
      "  holdfast import walk.bvh -o walk.npz     # convert a motion to the SMPL-X skeleton\n"
      "  holdfast grasp bottle.obj -o grasp.npz   # close a hand around an object\n\n"
      "Every command has --help with examples. Exit codes: 0 done, 1 invalid input,\n"
      "2 usage error, 3 the fit failed, 130 interrupted.",
      "holdfast"};
  app.set_version_flag("--version", "holdfast " HOLDFAST_VERSION "\n" HOLDFAST_MADE_OF);
  AddCompletionOption(app);
  app.require_subcommand(1);
  int exit_code = kDone;
  const auto library = std::make_shared<FitLibrary>();  // shared by all jobs of a batch
  const auto batchable = [&](const char* name, std::vector<std::string> extensions, auto add) {
    AddBatchable(app, {name, std::move(extensions), add}, exit_code);
  };
  batchable("fit", {}, [library](CLI::App& to, int& code) { AddFitCommand(to, code, library); });
  batchable("offhand", {},
            [library](CLI::App& to, int& code) { AddOffhandCommand(to, code, library); });
  batchable("grasp", {".npz"}, AddGraspCommand);
  batchable("import", {".npz"}, AddImportCommand);
  batchable("convert", {".npz", ".json"}, AddConvertCommand);
  AddDecimateCommand(app, exit_code);
  AddBodyCommand(app, exit_code);
  AddRenderCommand(app, exit_code);
  batchable("score", {".json"}, AddScoreCommand);
  AddDoctorCommand(app, exit_code);
  batchable("solve", {}, AddSolveCommand);
  batchable("export", {".glb", ".bvh", ".usda", ".xml", ".npz", ".jsonl", ".csv"},
            AddExportCommand);
  batchable("report", {".html"}, AddReportCommand);
  batchable("refine", {}, AddRefineCommand);
  batchable("transfer", {}, AddTransferCommand);
  AddReachCommand(app, exit_code);
  AddSynthesizeCommand(app, exit_code);
  AddMakeReachDataCommand(app, exit_code);
  AddMakeActionsCommand(app, exit_code);
  AddImportWeightsCommand(app, exit_code);
  return RunProgram(app, "holdfast", argc, argv, exit_code);
}
