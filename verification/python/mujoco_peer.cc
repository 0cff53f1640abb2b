// SPDX-License-Identifier: Apache-2.0
//
// Rollouts of MuJoCo's C library, for the comparison in benchmark.py.
#include <mujoco/mujoco.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <memory>
#include <stdexcept>
#include <string>

namespace py = pybind11;

namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

class Model {
 public:
  explicit Model(const std::string& file) {
    char error[1000] = "";
    model_.reset(mj_loadXML(file.c_str(), nullptr, error, sizeof(error)));
    if (!model_) throw std::runtime_error(error);
    data_.reset(mj_makeData(model_.get()));
  }

  // Positions (nq) after steps from the model's own state under generalised forces (steps x nv).
  Array Run(const Array& forces) {
    if (forces.ndim() != 2 || forces.shape(1) != model_->nv) {
      throw py::value_error("forces: expected steps x " + std::to_string(model_->nv));
    }
    mj_resetData(model_.get(), data_.get());
    for (py::ssize_t k = 0; k < forces.shape(0); ++k) {
      mju_copy(data_->qfrc_applied, forces.data(k, 0), model_->nv);
      mj_step(model_.get(), data_.get());
    }
    return Array(model_->nq, data_->qpos);
  }

 private:
  struct Delete {
    void operator()(mjModel* model) const { mj_deleteModel(model); }
    void operator()(mjData* data) const { mj_deleteData(data); }
  };
  std::unique_ptr<mjModel, Delete> model_;
  std::unique_ptr<mjData, Delete> data_;
};

}  // namespace

PYBIND11_MODULE(mujoco_peer, module) {
  py::class_<Model>(module, "Model").def(py::init<const std::string&>()).def("run", &Model::Run);
}
