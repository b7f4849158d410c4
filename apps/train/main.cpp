// SPDX-License-Identifier: MIT
#include "apps/program.h"
#include "apps/train/train_command.h"

// A program of its own, which `holdfast train` runs: LibTorch takes longer to load than most of
// holdfast's commands take.
int main(int argc, char** argv) {
  using namespace holdfast::apps;
  CLI::App app{"holdfast train: trains the networks that holdfast runs", "holdfast train"};
  app.require_subcommand(1);
  int exit_code = kDone;
  AddTrainImosCommand(app, exit_code);
  AddTrainRecognizerCommand(app, exit_code);
  AddTrainWandrCommand(app, exit_code);
  return RunProgram(app, "holdfast train", argc, argv, exit_code);
}
