# page.html and what belongs into it as two arrays of bytes: what stands before the data, and after.
#   cmake -DOUT=sim_page_parts.c -DTHREE=three.min.js -DORBIT=OrbitControls.js -DCHART=chart.min.js -P fold.cmake
# A place in page.html is a line <!-- NAME -->. Files are joined as bytes, in hexadecimal: in CMake's
# strings semicolons and brackets are not safe.

file(READ "${CMAKE_CURRENT_LIST_DIR}/page.html" page HEX)
foreach(place
    "style:${CMAKE_CURRENT_LIST_DIR}/page.css"
    "notices:${CMAKE_CURRENT_LIST_DIR}/notices.txt"
    "three:${THREE}"
    "orbit:${ORBIT}"
    "chart:${CHART}"
    "data.js:${CMAKE_CURRENT_LIST_DIR}/data.js"
    "picture.js:${CMAKE_CURRENT_LIST_DIR}/picture.js"
    "space.js:${CMAKE_CURRENT_LIST_DIR}/space.js"
    "charts.js:${CMAKE_CURRENT_LIST_DIR}/charts.js"
    "tables.js:${CMAKE_CURRENT_LIST_DIR}/tables.js"
    "page.js:${CMAKE_CURRENT_LIST_DIR}/page.js")
  string(FIND "${place}" ":" colon)
  string(SUBSTRING "${place}" 0 ${colon} name)
  math(EXPR colon "${colon} + 1")
  string(SUBSTRING "${place}" ${colon} -1 file)
  file(READ "${file}" content HEX)
  string(HEX "</script" closing)
  string(FIND "${content}" "${closing}" found)
  if(NOT found EQUAL -1)
    message(FATAL_ERROR "${file} would end the element that it stands in")
  endif()
  string(HEX "<!-- ${name} -->" mark)
  string(FIND "${page}" "${mark}" found)
  if(found EQUAL -1)
    message(FATAL_ERROR "page.html has no place <!-- ${name} -->")
  endif()
  string(REPLACE "${mark}" "${content}" page "${page}")
endforeach()

string(HEX "<!-- data -->" mark)
string(FIND "${page}" "${mark}" split)
if(split EQUAL -1)
  message(FATAL_ERROR "page.html has no place <!-- data -->")
endif()
string(LENGTH "${mark}" length)
string(SUBSTRING "${page}" 0 ${split} head)
math(EXPR split "${split} + ${length}")
string(SUBSTRING "${page}" ${split} -1 tail)

file(WRITE "${OUT}.new" "/* Made by sim/report/fold.cmake. */\n#include \"sim_page.h\"\n\n")
foreach(part head tail)
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${${part}}")
  file(APPEND "${OUT}.new"
    "const unsigned char sim_page_${part}[] = {${bytes}};\n"
    "const size_t sim_page_${part}_size = sizeof sim_page_${part};\n")
endforeach()
file(RENAME "${OUT}.new" "${OUT}")
