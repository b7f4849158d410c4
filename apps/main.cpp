// SPDX-License-Identifier: MIT
#include "apps/common.h"
#include "apps/completion.h"
#include "apps/program.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

int main(int argc, char** argv) {
  using namespace holdfast::apps;
#ifdef __GLIBC__
  // Megabytes that come and go with every block of frames stay with the process: pages given back
  // are cleared before they are given out again.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
#endif
  CLI::App app{
      "holdfast: fits objects to moving human hands, and human motion to goals.\n\n"
      "  holdfast fit demo_drink mug -o held      # an object held through a motion\n"
      "  holdfast import walk.bvh -o walk.npz     # a motion onto the SMPL-X skeleton\n"
      "  holdfast grasp bottle.obj -o grasp.npz   # a hand closed around an object\n\n"
      "Every command has --help with examples. Exit codes: 0 done, 1 invalid input,\n"
      "2 usage error, 3 the fit failed, 130 interrupted.",
      "holdfast"};
  app.set_version_flag("--version", "holdfast " HOLDFAST_VERSION);
  AddCompletionOption(app);
  app.require_subcommand(1);
  int exit_code = kDone;
  AddFitCommand(app, exit_code);
  AddOffhandCommand(app, exit_code);
  AddGraspCommand(app, exit_code);
  AddImportCommand(app, exit_code);
  AddConvertCommand(app, exit_code);
  AddDecimateCommand(app, exit_code);
  AddBodyCommand(app, exit_code);
  AddRenderCommand(app, exit_code);
  AddScoreCommand(app, exit_code);
  AddDoctorCommand(app, exit_code);
  AddSolveCommand(app, exit_code);
  AddExportCommand(app, exit_code);
  AddReportCommand(app, exit_code);
  AddEvaluateCommand(app, exit_code);
  AddRefineCommand(app, exit_code);
  AddTransferCommand(app, exit_code);
  AddReachCommand(app, exit_code);
  AddSynthesizeCommand(app, exit_code);
  AddMakeReachDataCommand(app, exit_code);
  AddMakeActionsCommand(app, exit_code);
  AddTrainCommand(app, exit_code);
  AddImportWeightsCommand(app, exit_code);
  return RunProgram(app, "holdfast", argc, argv, exit_code);
}
