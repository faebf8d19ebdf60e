# Make an overlay of YADE: cmake -DPREFIX= -DOVERLAY= -DSUBDIR=<of PREFIX, with libyade.so> -DPLUGIN= -DMODULE= -P overlay.cmake
# OVERLAY becomes a link to a folder beside it. A new one is built under a name of its own and the link then replaced by one rename,
# so that there is a whole overlay at any time; the one before stays for runs that still use it.
file(REAL_PATH ${PREFIX} PREFIX)
get_filename_component(parent ${OVERLAY} DIRECTORY)
get_filename_component(name ${OVERLAY} NAME)
file(MAKE_DIRECTORY ${parent})
string(TIMESTAMP now "%Y%m%dT%H%M%S" UTC)
string(RANDOM LENGTH 4 ALPHABET 0123456789abcdef salt)
set(fresh ${parent}/.${name}-${now}-${salt})
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE failed ERROR_VARIABLE message)
  if(failed)
    list(JOIN ARGN " " line)
    message(FATAL_ERROR "dembark: the overlay ${OVERLAY} could not be made: ${line}: ${message}")
  endif()
endfunction()
# YADE's start script has its own prefix built in, twice, and listens to the variable YADE_PREFIX, which for us names the engine
# below. In the overlay it must find itself.
file(READ ${PREFIX}/bin/yade script)
string(REGEX REPLACE "\nsys\\.path\\.insert\\([01],'[^'\n]*'\\)\n"
       "\nos.environ['YADE_PREFIX']=os.path.dirname(os.path.dirname(os.path.realpath(__file__)))\nsys.path.insert(0,os.environ['YADE_PREFIX']+'/${SUBDIR}/py')\n"
       patched "${script}")
if(patched STREQUAL script)
  message(FATAL_ERROR "dembark: ${PREFIX}/bin/yade does not look like YADE's start script (no sys.path.insert line); this YADE is not supported")
endif()
# A user's mistake is one line, not a trace.
string(REPLACE "\nif opts.script:\n"
"\nif opts.script and not os.path.exists(opts.script):
\tprint('dembark: there is no script '+opts.script,file=sys.stderr)
\tsys.exit(2)
if opts.script:\n" patched "${patched}")
string(REPLACE "\t\t\t\texcept: # all other exceptions\n"
"\t\t\t\texcept (NameError,ImportError) as error: # of a part that this build of YADE lacks
\t\t\t\t\tfrom yade.dembark.features import missing
\t\t\t\t\tline=missing(error)
\t\t\t\t\tif not line:
\t\t\t\t\t\timport traceback
\t\t\t\t\t\ttraceback.print_exc()
\t\t\t\t\telse: print(line,file=sys.stderr,flush=True)
\t\t\t\t\tif yade.runtime.opts.exitAfter: sys.exit(2 if line else 1)
\t\t\t\texcept (RuntimeError,AttributeError,KeyError) as error:
\t\t\t\t\tline,code,logged=getattr(sys,'dembark_failure',('',2,False))
\t\t\t\t\tif not line or line not in str(error): line,code,logged=str(error),2,False # a PyRunner quotes the line
\t\t\t\t\tif line.startswith('dembark: ') and yade.runtime.opts.exitAfter:
\t\t\t\t\t\tif not logged: print(line,file=sys.stderr,flush=True)
\t\t\t\t\t\tsys.exit(code)
\t\t\t\t\timport traceback
\t\t\t\t\ttraceback.print_exc()
\t\t\t\t\tif yade.runtime.opts.exitAfter: sys.exit(1)
\t\t\t\texcept: # all other exceptions\n" patched "${patched}")

# The start script and the folder of the libraries; a prefix such as /usr holds much else.
get_filename_component(around ${fresh}/${SUBDIR} DIRECTORY)
file(MAKE_DIRECTORY ${fresh}/bin ${around})
run(cp -rs ${PREFIX}/${SUBDIR} ${around}/)
run(cp ${PLUGIN} ${fresh}/${SUBDIR}/)
# Copies, not links: an overlay keeps working, and keeps one version of library and module, while the checkout changes.
file(GLOB files ${MODULE}/*.py)
file(MAKE_DIRECTORY ${fresh}/${SUBDIR}/py/yade/dembark)
run(cp ${files} ${fresh}/${SUBDIR}/py/yade/dembark/)

file(WRITE ${fresh}/bin/yade "${patched}")
file(CHMOD ${fresh}/bin/yade PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(previous "")
if(IS_SYMLINK ${OVERLAY})
  file(READ_SYMLINK ${OVERLAY} previous)
  set(previous ${parent}/${previous})
else()
  file(REMOVE_RECURSE ${OVERLAY})
endif()
get_filename_component(target ${fresh} NAME)
file(CREATE_LINK ${target} ${fresh}.link SYMBOLIC)
file(RENAME ${fresh}.link ${OVERLAY})
file(GLOB old ${parent}/.${name}-*)
list(REMOVE_ITEM old ${fresh} ${previous})
if(old)
  file(REMOVE_RECURSE ${old})
endif()
