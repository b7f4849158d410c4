// SPDX-License-Identifier: MIT
#include "apps/program.h"

#include <cstdio>
#include <exception>
#include <new>

#include <fmt/format.h>

#include "apps/common.h"
#include "apps/interrupt.h"
#include "geometry/error.h"

namespace holdfast::apps {

int RunProgram(CLI::App& app, std::string_view name, int argc, char** argv, const int& exit_code) {
  WatchForInterrupt();
  const auto named = [&](const CLI::App* command) { return command->check_name(argv[1]); };
  if (argc > 1 && argv[1][0] != '-' && app.get_subcommands(named).empty()) {
    fmt::print(stderr, "{0}: there is no command '{1}'. Run '{0} --help' for the list.\n", name,
               argv[1]);
    return kUsageFault;
  }
  try {
    app.parse(argc, argv);
    return exit_code;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsageFault;
  } catch (const FitFailure& error) {
    fmt::print(stderr, "{}: {}\n", name, error.what());
    return kFitFault;
  } catch (const std::bad_alloc&) {
    fmt::print(stderr, "{}: out of memory. Give a smaller input, or fewer threads.\n", name);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}: {}\n", name, error.what());
  }
  return kInputFault;
}

}  // namespace holdfast::apps
