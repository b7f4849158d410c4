// SPDX-License-Identifier: MIT
#include <pybind11/pybind11.h>

#include "geometry/error.h"
#include "python/src/bindings.h"
#include "python/src/run.h"

namespace holdfast::python {
void BindGenerators(pybind11::module_& module);  // generators.cpp
}  // namespace holdfast::python

PYBIND11_MODULE(_core, module) {
  namespace hf = holdfast::python;
  module.attr("__version__") = HOLDFAST_VERSION;
  static const pybind11::exception<holdfast::Error> error(module, "Error", PyExc_ValueError);
  static const pybind11::exception<holdfast::FitFailure> failure(module, "FitFailure",
                                                                 PyExc_RuntimeError);
  pybind11::register_exception<hf::Stopped>(module, "Stopped", PyExc_RuntimeError);
  module.attr("Error").attr("__doc__") =
      "Invalid input: the text names the place (a file or field), the problem and the remedy.";
  module.attr("FitFailure").attr("__doc__") = "The input is valid, but no result exists.";
  module.attr("Stopped").attr("__doc__") = "The progress callback returned False.";
  // The library names options as on the command line.
  pybind11::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const holdfast::Error& what) {
      PyErr_SetString(error.ptr(), hf::PythonText(what.what()).c_str());
    } catch (const holdfast::FitFailure& what) {
      PyErr_SetString(failure.ptr(), hf::PythonText(what.what()).c_str());
    }
  });
  hf::BindRun();
  hf::BindClip(module);
  hf::BindBody(module);
  hf::BindMesh(module);
  hf::BindData(module);
  hf::BindTerms(module);
  hf::BindFit(module);
  hf::BindMotion(module);
  hf::BindOptions(module);
  hf::BindFollow(module);
  hf::BindScore(module);
  hf::BindReport(module);
  hf::BindConvert(module);
  hf::BindExport(module);
  hf::BindMarkers(module);
  hf::BindRobot(module);
  hf::BindStudies(module);
  hf::BindGenerators(module);
  hf::BindTraining(module);
  hf::BindPickling(module);
  hf::GiveSignatures(module);
}
