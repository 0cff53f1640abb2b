// SPDX-License-Identifier: Apache-2.0
//
// The compiled part of the Python package. It is thin: the package's Python files
// give it names, units and documents.
#include "tangible/python/binding.h"

PYBIND11_MODULE(_core, module) {
  namespace py = pybind11;
  py::register_exception<tangible::python::Error>(module, "TangibleError", PyExc_ValueError);
  module.attr("__version__") = TANGIBLE_VERSION;
  tangible::python::BindScene(&module);
  tangible::python::BindSimulate(&module);
  tangible::python::BindRollout(&module);
  tangible::python::BindSimulation(&module);
  tangible::python::BindFit(&module);
  tangible::python::BindControl(&module);
}
