#include "render/make_backend.h"

#include "lightcuts/error.h"

namespace lightcuts {

std::unique_ptr<Backend> make_backend(const RenderOptions& options) {
  if (options.backend == BackendKind::cuda) {
    throw Error(Code::not_built, "the backend cuda is not part of this build yet; choose cpu");
  }
  return make_cpu_backend(options.threads);
}

}  // namespace lightcuts
