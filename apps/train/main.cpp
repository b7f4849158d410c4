// SPDX-License-Identifier: MIT
#include <cstdio>
#include <exception>

#include <fmt/format.h>

#include "apps/common.h"
#include "apps/interrupt.h"
#include "apps/train/train_wandr.h"
#include "geometry/error.h"

// A program of its own, which `holdfast train` runs: LibTorch takes longer to load than most of
// holdfast's commands take.
int main(int argc, char** argv) {
  using namespace holdfast::apps;
  CLI::App app{"holdfast train: trains the networks that holdfast runs", "holdfast train"};
  app.require_subcommand(1);
  int exit_code = kDone;
  AddTrainWandrCommand(app, exit_code);
  WatchForInterrupt();
  const auto named = [&](const CLI::App* command) { return command->check_name(argv[1]); };
  if (argc > 1 && argv[1][0] != '-' && app.get_subcommands(named).empty()) {
    fmt::print(stderr, "holdfast train: there is no network '{}' to train. There is: wandr.\n",
               argv[1]);
    return kUsageFault;
  }
  try {
    app.parse(argc, argv);
    return exit_code;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsageFault;
  } catch (const std::exception& error) {
    fmt::print(stderr, "holdfast train: {}\n", error.what());
  }
  return kInputFault;
}
