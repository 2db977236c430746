// Errors of arguments. They need no GPU.

#include <tests/hiprt_api/program.h>

TEST_CASE("a wrong version, and arguments that are missing") {
  hiprtContext context = nullptr;
  const hiprtContextCreationInput input{nullptr, 0, hiprt_api_test::kDeviceType};
  CHECK(hiprtCreateContext(HIPRT_API_VERSION + 1, input, context) == hiprtErrorInvalidApiVersion);
  CHECK(context == nullptr);
  const hiprtContextCreationInput other{nullptr, 0, hiprt_api_test::kOtherDeviceType};
  CHECK(hiprtCreateContext(HIPRT_API_VERSION, other, context) == hiprtErrorInternal);
  CHECK(context == nullptr);

  CHECK(hiprtDestroyContext(nullptr) == hiprtErrorInvalidParameter);
  CHECK(hiprtSetLogLevel(nullptr, 0) == hiprtErrorInvalidParameter);
  CHECK(hiprtSetCacheDirPath(nullptr, "x") == hiprtErrorInvalidParameter);
  hiprtGeometry geometry = nullptr;
  hiprtScene scene = nullptr;
  size_t size = 0;
  const hiprtGeometryBuildInput mesh{};
  const hiprtSceneBuildInput instances{};
  CHECK(hiprtCreateGeometry(nullptr, mesh, {0, 0}, geometry) == hiprtErrorInvalidParameter);
  CHECK(hiprtGetGeometryBuildTemporaryBufferSize(nullptr, mesh, {0, 0}, size) == hiprtErrorInvalidParameter);
  CHECK(hiprtBuildGeometry(nullptr, hiprtBuildOperationBuild, mesh, {0, 0}, nullptr, nullptr, geometry) ==
        hiprtErrorInvalidParameter);
  CHECK(hiprtCreateScene(nullptr, instances, {0, 0}, scene) == hiprtErrorInvalidParameter);
  CHECK(hiprtDestroyScene(nullptr, scene) == hiprtErrorInvalidParameter);
  hiprtFuncTable table = nullptr;
  CHECK(hiprtCreateFuncTable(nullptr, 1, 1, table) == hiprtErrorInvalidParameter);
  CHECK(hiprtDestroyGlobalStackBuffer(nullptr, {}) == hiprtErrorInvalidParameter);
}

TEST_CASE("without a GPU there is an error and no context", "[.no_device]") {
  hiprtContext context = nullptr;
  const hiprtContextCreationInput input{nullptr, 0, hiprt_api_test::kDeviceType};
  CHECK(hiprtCreateContext(HIPRT_API_VERSION, input, context) == hiprtErrorInternal);
  CHECK(context == nullptr);
}
