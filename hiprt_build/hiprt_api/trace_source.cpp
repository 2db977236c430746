#include <hiprt_build/hiprt_api/trace_source.h>

#include <set>

namespace hiprt::api {
namespace {

bool is_named(const char* name) { return name != nullptr && *name != '\0'; }

constexpr const char* kParameters =
    "(uint32_t geomType, uint32_t rayType, const hiprtFuncTableHeader& tableHeader, const hiprtRay& ray, "
    "void* payload, ";

/// One of the two dispatchers.
struct Dispatcher {
  const char* name;
  const char* hit;                          ///< Type of the last parameter.
  const char* data;                         ///< Member of hiprtFuncDataSet.
  const char* hiprtFuncNameSet::*function;  ///< Member of hiprtFuncNameSet.
};

std::string text_of(const Dispatcher& dispatcher, const FunctionNames& names) {
  std::string declarations, cases;
  std::set<std::string> declared;
  const std::uint64_t count =
      names.sets == nullptr ? 0 : std::uint64_t{names.geometry_types} * std::uint64_t{names.ray_types};
  for (std::uint64_t k = 0; k < count; ++k) {
    const char* const name = names.sets[k].*dispatcher.function;
    if (!is_named(name)) continue;
    if (declared.insert(name).second)
      declarations += std::string("HIPRT_DEVICE bool ") + name + "(const hiprtRay& ray, const void* data, " +
                      "void* payload, " + dispatcher.hit + " hit);\n";
    const std::string number = std::to_string(k);
    cases += "    case " + number + "u: return " + name + "(ray, tableHeader.funcDataSets[" + number + "u]." +
             dispatcher.data + ", payload, hit);\n";
  }
  return declarations + "HIPRT_DEVICE bool " + dispatcher.name + kParameters + dispatcher.hit +
         " hit) {\n  switch (tableHeader.numGeomTypes * rayType + geomType) {\n" + cases +
         "    default: return false;\n  }\n}\n";
}

}  // namespace

std::string dispatcher_of(const FunctionNames& names) {
  return text_of({"intersectFunc", "hiprtHit&", "intersectFuncData", &hiprtFuncNameSet::intersectFuncName}, names) +
         text_of({"filterFunc", "const hiprtHit&", "filterFuncData", &hiprtFuncNameSet::filterFuncName}, names);
}

std::string program_of(const FunctionNames& names, const char* source, const char* file) {
  std::string quoted;
  for (const char* at = file; *at != '\0'; ++at) {
    if (*at == '"' || *at == '\\') quoted += '\\';
    if (*at != '\n') quoted += *at;
  }
  return "#include <hiprt/impl/hiprt_device_impl.h>\n" + dispatcher_of(names) + "#line 1 \"" + quoted + "\"\n" + source;
}

}  // namespace hiprt::api
