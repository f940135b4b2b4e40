// Validates the GLB files named on the command line with Khronos' gltf-validator; any error, warning, information or
// hint makes it exit with 1. Run it in a folder where `npm install gltf-validator` was run:
//
//     node …/tests/reference/gltf_validate.mjs face.glb …
import { createRequire } from 'node:module';
import { readFile } from 'node:fs/promises';
import { join } from 'node:path';

const validator = createRequire(join(process.cwd(), 'here.js'))('gltf-validator');
const files = process.argv.slice(2);
let bad = files.length === 0;
if (bad) console.error('name at least one file');

for (const file of files) {
  const report = await validator.validateBytes(new Uint8Array(await readFile(file)), { uri: file });
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos, ${numHints} hints`);
  for (const { code, message, pointer } of messages) console.log(`  ${code} ${pointer ?? ''}: ${message}`);
  bad ||= messages.length > 0;
}
process.exit(bad ? 1 : 0);
