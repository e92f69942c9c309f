# Manual pages and completions, made by the programs: not for those that other machines run, or that sanitizers slow down.
if(CMAKE_CROSSCOMPILING OR SLABSTREAM_SANITIZE)
  return()
endif()
set(manual ${CMAKE_BINARY_DIR}/manual)
set(programs slabstream slabstream-coordinator slabstream-gateway slabstream-laboratory slabstream-worker)
add_custom_command(OUTPUT ${manual}/done
  COMMAND ${CMAKE_COMMAND} -DPROGRAMS=${CMAKE_BINARY_DIR}/bin -DOUTPUT=${manual} -P ${CMAKE_CURRENT_LIST_DIR}/write_manual.cmake
  DEPENDS ${programs} ${CMAKE_CURRENT_LIST_DIR}/write_manual.cmake
  COMMENT "Writing manual pages and completions")
add_custom_target(manual ALL DEPENDS ${manual}/done)
foreach(page slabstream-coordinator:server slabstream-worker:server slabstream-gateway:gateway slabstream-bench:lab slabstream-experiment:lab)
  string(REPLACE ":" ";" page ${page})
  list(GET page 0 name)
  list(GET page 1 component)
  install(FILES ${manual}/man/${name}.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT ${component})
endforeach()
install(DIRECTORY ${manual}/man/ DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT cli REGEX "slabstream-(bench|coordinator|experiment|gateway|worker)"
  EXCLUDE)
install(FILES ${manual}/completions/bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME slabstream COMPONENT cli)
install(FILES ${manual}/completions/zsh DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions RENAME _slabstream COMPONENT cli)
install(FILES ${manual}/completions/fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d RENAME slabstream.fish COMPONENT cli)
