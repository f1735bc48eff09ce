# Writes a file as a C++ string: cmake -D PAGE=page.html -D SOURCE=page.cpp -P page.cmake
file(READ "${PAGE}" text)
file(WRITE "${SOURCE}" "#include \"client/viewer/page.h\"\n\nstd::string_view binpose::client::viewer_page() {\n"
  "  return R\"PAGE(${text})PAGE\";\n}\n")
