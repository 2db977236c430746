# The language level of kernels that CMake's own languages CUDA and HIP compile. Included by CMakeLists.txt and by the
# installed config, because it asks which languages the project has enabled.

# hiprt_language_level(<target>): its users' CUDA and HIP sources are C++20.
function(hiprt_language_level target)
  get_property(enabled GLOBAL PROPERTY ENABLED_LANGUAGES)
  foreach(language IN ITEMS CUDA HIP)
    string(TOLOWER ${language}_std_20 feature)
    if(NOT language IN_LIST enabled)
      continue()
    elseif(feature IN_LIST CMAKE_${language}_COMPILE_FEATURES)
      target_compile_features(${target} INTERFACE ${feature})
    else()
      # Older versions of CMake do not know that the compiler has C++20.
      target_compile_options(${target} INTERFACE $<$<COMPILE_LANGUAGE:${language}>:-std=c++20>)
    endif()
  endforeach()
endfunction()
