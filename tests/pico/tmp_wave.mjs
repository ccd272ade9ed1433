import { Board } from './machine.mjs';
import { Host, ofKind, same, READOUT_MS } from './host.mjs';
const [, , wstac, config, ...programs] = process.argv;
const host = new Host(wstac);
for (const arg of programs) {
  const [program, model] = arg.split(':');
  const expected = host.ofClip('--features', '--config', config, ...(model ? ['--model', model] : []));
  const { frames } = host;
  const board = new Board(program, frames);
  board.requests.push(Buffer.from([]));
  const sent = board.play();
  const lines = ofKind(host.ofLine(sent), 'event');
  const told = host.told();
  const events = ofKind(expected, 'event').map(l => l.replace(/"acceleration":\{[^}]*\},/, ''));
  console.log(program, 'events same:', same(lines, events), 'told', JSON.stringify(told), 'instructions', (board.instructions - board.instructionsBefore) / frames.length, 'resets', board.resets);
  if (!same(lines, events)) console.log(lines, events);
  host.ofLine(sent, '--status'); console.log(host.notes.split('\n').filter(l => l.includes('stack') || l.includes('lost')).slice(-2).join('\n'));
}
