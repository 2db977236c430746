# Writes a C++ source with the text of headers.
# usage: cmake -DROOT=FOLDER -DFOLDER=hiprt_device -DFUNCTION=embedded_headers -DOUTPUT=FILE -P embed_headers.cmake
# The headers are those below ROOT/FOLDER, and FUNCTION() returns them.
# Headers of hiprt_device/compat have the names that programs of HIPRT write: hiprt/hiprt_device.h.
file(GLOB_RECURSE headers RELATIVE ${ROOT} ${ROOT}/${FOLDER}/*.h)
list(SORT headers)
set(table "")
file(WRITE ${OUTPUT}.new
  "#include <hiprt_build/rtc/embedded_headers.h>\n\nnamespace hiprt::gpu::rtc {\nnamespace {\n\n")
foreach(header IN LISTS headers)
  file(READ ${ROOT}/${header} text)
  file(APPEND ${OUTPUT}.new "constexpr char k")
  string(MAKE_C_IDENTIFIER "${header}" name)
  file(APPEND ${OUTPUT}.new "${name}[] = R\"hiprt(${text})hiprt\";\n")
  string(REGEX REPLACE "^hiprt_device/compat/" "" included "${header}")
  string(APPEND table "    {\"${included}\", k${name}},\n")
endforeach()
file(APPEND ${OUTPUT}.new "constexpr EmbeddedHeader kHeaders[] = {\n${table}};\n\n}  // namespace\n
std::span<const EmbeddedHeader> ${FUNCTION}();
std::span<const EmbeddedHeader> ${FUNCTION}() { return kHeaders; }\n\n}  // namespace hiprt::gpu::rtc\n")
file(RENAME ${OUTPUT}.new ${OUTPUT})
