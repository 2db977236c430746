#include <hiprt_build/python/gpu/kernel_source.h>

#include <hiprt_build/python/tracers/kernels.h>
#include <hiprt_device/traverse/stacks/stack.h>

namespace hiprt::python::gpu {
namespace {

std::string layout_of(const SceneView& scene) {
  switch (scene.layout) {
    case NodeLayout::kFloat:
      return "FloatLayout";
    case NodeLayout::kHalf:
      return "HalfLayout";
    case NodeLayout::kQuantized:
      return "QuantizedLayout";
    case NodeLayout::kPlanes:
      break;
  }
  return "PlanesLayout";
}

/// The scene's need, in few steps, so that similar scenes share a kernel.
unsigned stack_entries(const SceneView& scene) {
  constexpr unsigned kStep = 32;
  return (scene.stack_bound + kMostPushed + kStep - 1) / kStep * kStep;
}

bool uses_fast_triangles(const SceneView& scene, Precision precision) {
  return precision == Precision::kFast && is_flat(scene);
}

/// The same choices as those of the tracers for CPUs (tracers/).
std::string policies_of(const SceneView& scene, bool is_double, Precision precision) {
  std::string type = "TracerPolicies<" + layout_of(scene) + ", " + std::to_string(stack_entries(scene));
  if (precision == Precision::kReference) type += ", Reference";
  if (uses_fast_triangles(scene, precision)) type += ", Fast, Plain";
  type += ">";
  if (is_double) type = "DoubleRays<" + type + ">";
  if (scene.levels != 0) type = "Instanced<" + type + ", " + std::to_string(scene.levels) + ">";
  if ((scene.features & feature_bit(Feature::kMotion)) != 0) type = "Moving<" + type + ">";
  return type;
}

const char* job_of(Answer answer) {
  switch (answer) {
    case Answer::kCast:
      return "CastJob";
    case Answer::kOccluded:
      return "OccludedJob";
    case Answer::kCount:
      return "CountJob";
    case Answer::kPoint:
      break;
  }
  return "PointJob";
}

}  // namespace

KernelSource kernel_source(const SceneView& scene, Answer answer, Precision precision) {
  const bool is_point = answer == Answer::kPoint, has_customs = (scene.features & feature_bit(Feature::kCustom)) != 0;
  const std::string job = job_of(answer);
  std::string call = "answer<Tracer, " + std::string(has_customs ? "SceneShapes" : "NoPrimitives") + ">";
  if (is_point)
    call = std::string("answer_point<Tracer, ") + (precision == Precision::kDouble ? "double" : "float") + ">";
  std::string text =
      "#include <hip/hip_runtime.h>\n#include <hiprt_build/python/gpu/device/queries.h>\n"
      "namespace hiprt::python::gpu {\nstruct Tracer : " +
      policies_of(scene, is_point || precision == Precision::kDouble, precision) +
      " {\n  static constexpr FeatureMask kFeatures = " + std::to_string(scene.features) + "u;\n};\n" +
      "extern \"C\" __global__ void __launch_bounds__(" + std::to_string(kBlockThreads) + ") " + kKernel +
      "(SceneView scene, " + job + " job, unsigned long long size) {\n" +
      "  const unsigned long long i = blockIdx.x * static_cast<unsigned long long>(blockDim.x) + threadIdx.x;\n"
      "  if (i < size) " +
      call + "(scene, job, i);\n}\n}\n";
  return {std::move(text), !uses_fast_triangles(scene, precision)};
}

}  // namespace hiprt::python::gpu
