// SPDX-License-Identifier: MIT
#include <pybind11/pybind11.h>

#include "geometry/error.h"
#include "python/src/bindings.h"
#include "python/src/run.h"

PYBIND11_MODULE(_core, module) {
  namespace hf = holdfast::python;
  module.attr("__version__") = HOLDFAST_VERSION;
  pybind11::register_exception<holdfast::Error>(module, "Error", PyExc_ValueError);
  pybind11::register_exception<hf::Stopped>(module, "Stopped", PyExc_RuntimeError);
  pybind11::register_exception<hf::FitFailure>(module, "FitFailure", PyExc_RuntimeError);
  hf::BindRun();
  hf::BindClip(module);
  hf::BindBody(module);
  hf::BindMesh(module);
  hf::BindData(module);
  hf::BindTerms(module);
  hf::BindFit(module);
  hf::BindMotion(module);
  hf::BindFollow(module);
  hf::BindScore(module);
  hf::BindReport(module);
  hf::BindConvert(module);
  hf::BindExport(module);
  hf::BindMarkers(module);
  hf::BindRobot(module);
}
