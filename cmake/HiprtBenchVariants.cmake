# Chooses the kernels of bench_variants and generates their .hip files, one file per layout and stack.
#
# A selection is "axis=value,value ...": the cross product of its values. An axis that it does not name has its default
# value (below). "*" means all values of an axis. hiprt_can_be() filters out impossible combinations.

set(HIPRT_BENCH_VARIANTS "small" CACHE STRING
  "Kernels of bench_variants: 'small' (every policy at least once), 'full' (the kernels to measure on a GPU; minutes \
to compile), or a list of selections. A selection combines any policies, such as \
'layouts=planes,quantized schedules=batch12,postponed;queries=all stacks=*'")
set_property(CACHE HIPRT_BENCH_VARIANTS PROPERTY STRINGS small full)

# Values and the C++ types behind them (benchmarks/variants/gpu_kernel.h).
set(hiprt_axes queries layouts stacks schedules tests orders features blocks answers)
set(hiprt_values_queries closest=Query::kClosest any=Query::kAny all=Query::kAll)
set(hiprt_values_layouts float=FloatLayout planes=PlanesLayout half=HalfLayout quantized=QuantizedLayout)
# -paths: the state per level of instances (PathMemory) is in shared memory.
set(hiprt_values_stacks private=PrivateStorage shared-paths=SharedPathStorage tiered=TieredStorage<16>
  tiered8=TieredStorage<8> tiered22=TieredStorage<22> tiered-paths=TieredPathStorage<16>
  tiered22-paths=TieredPathStorage<22> shared=SharedStorage rolling=RollingStorage rolling-pool=RollingPoolStorage
  global=GlobalStorage restart=RestartStorage)
# batchN has the default kSearchAbove; batchNvM sets it to M lanes.
set(hiprt_values_schedules immediate=Immediate postponed=Postponed batch1=WholeWave<1> batch8=WholeWave<8>
  batch12=WholeWave<12> batch16=WholeWave<16> batch20=WholeWave<20> batch12v0=WholeWave<12,0> batch12v8=WholeWave<12,8>)
# Triangle test and box test; 'hardware' is AMD's ray instruction.
set(hiprt_values_tests accurate=Tests<Watertight,Conservative> fast=Tests<Fast,Plain>
  reference=Tests<Reference,Conservative> watertight-plain=Tests<Watertight,Plain>
  fast-conservative=Tests<Fast,Conservative>
  watertight-hardware=Tests<Watertight,HardwareBoxes> fast-hardware=Tests<Fast,HardwareBoxes>
  hardware=Tests<HardwareTriangle,HardwareBoxes> hardware-conservative=Tests<HardwareTriangle,Conservative>
  hardware-plain=Tests<HardwareTriangle,Plain>)
# usual: the library's default for the query and the tests.
set(hiprt_values_orders sorted=NearFirst nearest=NearestFirst stored=Unordered tested=AsTested)
set(hiprt_values_features triangles=TrianglesOnly splits=WithSplits masks=WithMasks filter=WithFilter custom=WithCustom
  custom-filter=WithCustomAndFilter placed=Placed levels1=WithLevels<1> levels2=WithLevels<2> levels8=WithLevels<8>
  levels32=WithLevels<32> moving1=WithMotion<1> moving2=WithMotion<2> moving8=WithMotion<8>)
set(hiprt_values_blocks 64x1 64x8 64x10 64x12 64x14 64x16 128x7 128x8)
# id: rays of 32 bytes, results of 8. hit: Ray and Hit, as programs have them.
set(hiprt_values_answers id=Answer::kId hit=Answer::kHit)

# The value of an axis that a selection does not name.
set(hiprt_default_queries closest any)
set(hiprt_default_layouts planes)
set(hiprt_default_stacks private)
set(hiprt_default_schedules batch12)
set(hiprt_default_tests accurate)
set(hiprt_default_orders usual)
set(hiprt_default_features masks)
set(hiprt_default_blocks 64x14)
set(hiprt_default_answers id)

set(hiprt_selections_small
  "layouts=float,half,quantized schedules=postponed queries=closest"
  "stacks=shared,rolling,rolling-pool,global,restart schedules=postponed queries=any"
  "schedules=immediate,batch8,batch16 queries=closest"
  "tests=fast schedules=batch1 queries=any"
  "orders=sorted schedules=batch20 queries=any"
  "orders=nearest blocks=128x7 queries=closest"
  "features=triangles,splits,filter,custom schedules=postponed queries=closest"
  "features=custom schedules=batch12v0 queries=any"
  "features=levels1,levels8,moving2 schedules=postponed queries=closest"
  "features=levels1 stacks=shared-paths,tiered-paths schedules=batch16 queries=closest"
  "stacks=tiered queries=any"
  "features=placed queries=closest"
  "answers=hit queries=closest"
  "features=custom schedules=postponed queries=all"
  "layouts=float tests=watertight-hardware queries=closest"
  "layouts=float tests=watertight-hardware stacks=tiered8 schedules=immediate queries=closest"
  "layouts=half tests=hardware schedules=immediate queries=closest")
set(hiprt_selections_full
  "layouts=* schedules=immediate,postponed,batch1,batch12,batch16 tests=accurate,fast"
  "layouts=planes,quantized schedules=*"
  "layouts=* stacks=* schedules=postponed,batch12"
  "layouts=planes,quantized stacks=shared,rolling schedules=immediate,batch1,batch16,batch12v0"
  "layouts=* schedules=postponed,batch12 queries=closest orders=nearest"
  "layouts=* schedules=postponed,batch12 queries=any orders=sorted"
  "layouts=planes,quantized schedules=postponed,batch12 tests=fast queries=closest orders=nearest"
  "layouts=planes,quantized schedules=postponed,batch12 tests=fast queries=any orders=sorted"
  "layouts=* schedules=postponed,batch12 features=triangles,splits,masks,filter,custom"
  "layouts=planes,quantized schedules=postponed,batch12 features=levels1,levels2,levels8,levels32,moving1,moving2"
  "layouts=planes,quantized stacks=private,shared-paths schedules=immediate,postponed,batch12,batch16 features=levels1"
  "stacks=tiered-paths,tiered22-paths schedules=postponed,batch12 features=levels1"
  "schedules=postponed,batch12 features=placed"
  "layouts=planes,quantized schedules=postponed,batch12 tests=accurate,fast answers=hit"
  "stacks=shared-paths,tiered-paths,tiered22-paths features=moving1 blocks=64x10"
  "stacks=tiered,tiered22 schedules=batch1v0 queries=closest features=levels8 blocks=64x12"
  "layouts=planes,quantized schedules=postponed,batch12 features=moving1 blocks=64x12,64x10"
  "layouts=planes,quantized schedules=postponed,batch12,batch1v0 queries=closest features=levels8 blocks=64x12"
  "layouts=planes,quantized schedules=postponed,batch1,batch12 blocks=*"
  "layouts=planes,quantized stacks=rolling schedules=batch12 blocks=*"
  "layouts=* queries=all schedules=immediate,postponed features=triangles,masks"
  "layouts=float,half tests=watertight-hardware,hardware schedules=immediate,postponed,batch12"
  "layouts=float,half tests=watertight-hardware,hardware stacks=rolling schedules=postponed,batch12"
  "layouts=float,half tests=watertight-hardware stacks=tiered8 schedules=immediate,postponed,batch12")

# hiprt_axis_type(<axis> <value> <variable>): the C++ type of a value, or an error that lists the values.
function(hiprt_axis_type axis value variable)
  foreach(pair IN LISTS hiprt_values_${axis})
    if(pair MATCHES "^([^=]*)=(.*)$" AND CMAKE_MATCH_1 STREQUAL value)
      set(${variable} "${CMAKE_MATCH_2}" PARENT_SCOPE)
      return()
    endif()
  endforeach()
  # Any numbers of threads, blocks and lanes are valid.
  if(axis STREQUAL "blocks" AND value MATCHES "^([0-9]+)x([0-9]+)$")
    set(${variable} "${CMAKE_MATCH_1}, ${CMAKE_MATCH_2}" PARENT_SCOPE)
  elseif(axis STREQUAL "schedules" AND value MATCHES "^batch([0-9]+)$")
    set(${variable} "WholeWave<${CMAKE_MATCH_1}>" PARENT_SCOPE)
  elseif(axis STREQUAL "schedules" AND value MATCHES "^batch([0-9]+)v([0-9]+)$")
    set(${variable} "WholeWave<${CMAKE_MATCH_1}, ${CMAKE_MATCH_2}>" PARENT_SCOPE)
  else()
    message(FATAL_ERROR "HIPRT_BENCH_VARIANTS: no value '${value}' of ${axis} (values: ${hiprt_values_${axis}})")
  endif()
endfunction()

# hiprt_read_selection(<text>): sets selected_<axis> for every axis.
macro(hiprt_read_selection text)
  foreach(axis IN LISTS hiprt_axes)
    set(selected_${axis} ${hiprt_default_${axis}})
  endforeach()
  string(REPLACE " " ";" words "${text}")
  foreach(word IN LISTS words)
    if(NOT word MATCHES "^([a-z]+)=(.+)$" OR NOT CMAKE_MATCH_1 IN_LIST hiprt_axes)
      message(FATAL_ERROR "HIPRT_BENCH_VARIANTS: '${word}' is not AXIS=VALUE,... (axes: ${hiprt_axes})")
    endif()
    set(axis ${CMAKE_MATCH_1})
    if(CMAKE_MATCH_2 STREQUAL "*")
      set(selected_${axis} ${hiprt_values_${axis}})
      list(TRANSFORM selected_${axis} REPLACE "=.*" "")
    else()
      string(REPLACE "," ";" selected_${axis} "${CMAKE_MATCH_2}")
    endif()
  endforeach()
endmacro()

# hiprt_usual_order(<variable>): the library's order for the values query, tests and features of the caller.
function(hiprt_usual_order variable)
  if(tests MATCHES "hardware$")
    set(${variable} tested PARENT_SCOPE)
  elseif(query STREQUAL "any" OR (query STREQUAL "all" AND features STREQUAL "triangles"))
    set(${variable} stored PARENT_SCOPE)
  else()
    set(${variable} sorted PARENT_SCOPE)
  endif()
endfunction()

# hiprt_can_be(<variable>): whether the caller's values query, layout, stack, schedule, tests, order, features and
# answers are a valid combination.
function(hiprt_can_be variable)
  set(${variable} FALSE PARENT_SCOPE)
  # trace_batch() finds one hit per ray.
  if(query STREQUAL "all" AND schedule MATCHES "^batch")
    return()
  endif()
  # The results of all hits are sums.
  if(answers STREQUAL "hit" AND query STREQUAL "all")
    return()
  endif()
  # AMD's ray instruction supports two layouts, and its box test sorts.
  if(tests MATCHES "hardware" AND NOT (HIPRT_GPU_PLATFORM STREQUAL "AMD" AND layout MATCHES "^(float|half)$"))
    return()
  endif()
  if((tests MATCHES "hardware$" AND NOT order STREQUAL "tested") OR
      (NOT tests MATCHES "hardware$" AND order STREQUAL "tested"))
    return()
  endif()
  # A restart trail needs children sorted by distance if hits shorten the ray, else in a stable order.
  hiprt_usual_order(usual)
  if(stack STREQUAL "restart" AND features MATCHES "^(levels|moving)")
    return()
  endif()
  if(stack STREQUAL "restart" AND NOT order STREQUAL "sorted" AND NOT (order STREQUAL "stored"
    AND usual STREQUAL "stored"))
    return()
  endif()
  # The state of more levels does not fit into the shared memory of a block.
  if(stack MATCHES "paths$" AND NOT features MATCHES "^(levels|moving)[12]$")
    return()
  endif()
  set(${variable} TRUE PARENT_SCOPE)
endfunction()

# hiprt_variant_line(<variable>): the C++ line for the values query, layout, stack, schedule, tests, order, features,
# blocks and answers of the caller; empty for an impossible combination.
function(hiprt_variant_line variable)
  set(${variable} "" PARENT_SCOPE)
  if(order STREQUAL "usual")
    hiprt_usual_order(order)
  endif()
  hiprt_axis_type(queries ${query} query_type)
  hiprt_axis_type(layouts ${layout} layout_type)
  hiprt_axis_type(stacks ${stack} stack_type)
  hiprt_axis_type(schedules ${schedule} schedule_type)
  hiprt_axis_type(tests ${tests} tests_type)
  hiprt_axis_type(orders ${order} order_type)
  hiprt_axis_type(features ${features} features_type)
  hiprt_axis_type(blocks ${blocks} bounds)
  hiprt_axis_type(answers ${answers} answers_type)
  hiprt_can_be(can_be)
  if(NOT can_be)
    return()
  endif()
  set(policies "VariantPolicies<${layout_type}, ${stack_type}, ${schedule_type}, ${tests_type}, ${order_type}, \
${features_type}, ${answers_type}>")
  set(name "\"${query}\", \"${layout}\", \"${tests}\", \"${stack}\", \"${schedule}\", \"${order}\", \
\"${features}\", \"${blocks}\", \"${answers}\"")
  set(${variable} "  add_kernel<${policies}, ${query_type}, ${bounds}>(kernels, {${name}})" PARENT_SCOPE)
endfunction()

# hiprt_expand_selection(<text>): appends each line of the selection once to the caller's lines_<layout>_<stack>.
function(hiprt_expand_selection text)
  hiprt_read_selection("${text}")
  foreach(layout IN LISTS selected_layouts)
    foreach(stack IN LISTS selected_stacks)
      set(list lines_${layout}_${stack})
      foreach(schedule IN LISTS selected_schedules)
        foreach(tests IN LISTS selected_tests)
          foreach(order IN LISTS selected_orders)
            foreach(features IN LISTS selected_features)
              foreach(blocks IN LISTS selected_blocks)
                foreach(answers IN LISTS selected_answers)
                  foreach(query IN LISTS selected_queries)
                    hiprt_variant_line(line)
                    list(APPEND ${list} "${line}")
                  endforeach()
                endforeach()
              endforeach()
            endforeach()
          endforeach()
        endforeach()
      endforeach()
      list(REMOVE_DUPLICATES ${list})
      list(REMOVE_ITEM ${list} "")
      set(${list} "${${list}}" PARENT_SCOPE)
    endforeach()
  endforeach()
endfunction()

# hiprt_write_kernels(<file> <function> <line>...): writes a .hip file with a function that adds the lines' kernels.
function(hiprt_write_kernels file function)
  list(JOIN ARGN ";\n" body)
  file(CONFIGURE OUTPUT ${file} @ONLY CONTENT [[
// Made by cmake/HiprtBenchVariants.cmake.
#include <benchmarks/variants/gpu_kernel.h>

namespace hiprt::bench {

void @function@(std::vector<GpuKernel>& kernels) {
@body@;
}

}  // namespace hiprt::bench
]])
endfunction()

# hiprt_write_kernel_list(<file> <function>...): writes gpu_kernels(), which calls the functions.
function(hiprt_write_kernel_list file)
  set(declarations "")
  set(calls "")
  foreach(function IN LISTS ARGN)
    string(APPEND declarations "void ${function}(std::vector<GpuKernel>& kernels);\n")
    string(APPEND calls "  ${function}(kernels);\n")
  endforeach()
  file(CONFIGURE OUTPUT ${file} @ONLY CONTENT [[
// Made by cmake/HiprtBenchVariants.cmake.
#include <benchmarks/variants/gpu_kernels.h>

namespace hiprt::bench {

@declarations@
std::vector<GpuKernel> gpu_kernels() {
  std::vector<GpuKernel> kernels;
@calls@  return kernels;
}

}  // namespace hiprt::bench
]])
endfunction()

# hiprt_generate_variants(<folder> <variable>): writes <folder>/LAYOUT_STACK.hip, and <folder>/gpu_kernels.cpp with the
# list of their kernels, for HIPRT_BENCH_VARIANTS. Sets <variable> to the .hip files. Files without changes keep their
# time stamps.
function(hiprt_generate_variants folder variable)
  set(selections "${HIPRT_BENCH_VARIANTS}")
  if(selections MATCHES "^(small|full)$")
    set(selections "${hiprt_selections_${selections}}")
  endif()
  foreach(selection IN LISTS selections)
    hiprt_expand_selection("${selection}")
  endforeach()
  set(files "")
  set(functions "")
  set(all "")
  foreach(layout IN LISTS hiprt_values_layouts)
    foreach(stack IN LISTS hiprt_values_stacks)
      string(REGEX REPLACE "=.*" "" name "${layout}")
      string(REGEX REPLACE "^(.*)=.*" "${name}_\\1" name "${stack}")
      if(lines_${name})
        string(MAKE_C_IDENTIFIER "add_${name}" function)
        hiprt_write_kernels(${folder}/${name}.hip ${function} ${lines_${name}})
        list(APPEND files ${folder}/${name}.hip)
        list(APPEND functions ${function})
        list(APPEND all ${lines_${name}})
      endif()
    endforeach()
  endforeach()
  hiprt_write_kernel_list(${folder}/gpu_kernels.cpp ${functions})
  list(LENGTH all count)
  if(count EQUAL 0)
    message(FATAL_ERROR "HIPRT_BENCH_VARIANTS: none of these combinations is valid (hiprt_can_be()): ${selections}")
  endif()
  message(STATUS "bench_variants: ${count} kernels (HIPRT_BENCH_VARIANTS)")
  set(${variable} "${files}" PARENT_SCOPE)
endfunction()
