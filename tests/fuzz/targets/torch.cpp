// SPDX-License-Identifier: MIT
#include "geometry/io/pickle/torch_archive.h"
#include "tests/fuzz/data_checks.h"
#include "tests/fuzz/fuzz_target.h"

HOLDFAST_FUZZ_TARGET(torch) {
  const holdfast::ZipArchive archive(holdfast::ByteSource(trial.Bytes(), "result.pt"));
  const holdfast::DataValue root = holdfast::ReadTorchArchive(archive);
  trial.Accept();
  holdfast::fuzz::InterrogateAll(root);
}
