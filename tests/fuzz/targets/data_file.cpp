// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/data_file.h"

#include "tests/fuzz/data_checks.h"
#include "tests/fuzz/fuzz_target.h"
#include "tests/fuzz/memory_file.h"

// Any container, format detected from the content: .npy, JSON and the older torch files have no
// other target.
HOLDFAST_FUZZ_TARGET(data_file) {
  const holdfast::fuzz::MemoryFile bytes(trial.Bytes());
  const holdfast::DataFile file(bytes.Path());
  const std::vector<std::string> names = file.Names();
  trial.StopCounting();
  const holdfast::DataValue root = file.Root();
  trial.Accept();
  for (const std::string& name : names) {
    holdfast::fuzz::Require(file.Has(name), "a file has what it lists");
  }
  holdfast::fuzz::Require(!holdfast::DataFormatName(file.Format()).empty(), "a format has a name");
  file.Metadata();
  holdfast::fuzz::InterrogateAll(root);
}
